#include "node.h"

#include "hardware.h"

#define ASK_AGAIN_NS 10000000
#define HELLO_PERIOD_NS_MAX 200000000
#define LEAD_IN_NS 20000000
#define SAMPLE_NS ((uint64_t)TERMS_TICK_NS * CODEC_TICKS_PER_SAMPLE)
enum { BYTES_AT_ONCE = 256, NOTICE_ASK = 1, NOTICE_HERE = 2 };

static const double counts_per_turn[CODEC_OUTPUTS] = TERMS_COUNTS_PER_TURN;
static const double turn[CODEC_OUTPUTS] = TERMS_TURN;
static const int32_t sign[CODEC_OUTPUTS] = TERMS_SIGN;
static const int32_t zero_counts[CODEC_OUTPUTS] = TERMS_ZERO_COUNTS;

void node_begin(node *own, uint32_t incarnation) {
    memset(own, 0, sizeof *own);
    own->phase = NODE_GREETING;
    own->incarnation = incarnation;
    own->owed_from_tick = CODEC_LEAD_TICKS;
    own->symbol_at = CODEC_SYMBOLS_PER_WORD;
    own->asked_ns = hardware_now_ns() - HELLO_PERIOD_NS_MAX;
    guard_begin(&own->guard);
    codec_initial(&own->confirmed);
    codec_probe(own->probe); /* the longest computation of all: once, before the first request */
    wire_begin(&own->reader);
    for (int input = 0; input < CODEC_INPUTS; input++) hardware_write_motor(input, own->guard.command[input]);
    wire_send_notice(NOTICE_ASK);
}

/* Receiving */

static void take_bytes(node *own) {
    for (int count = 0; count < BYTES_AT_ONCE; count++) {
        const int byte = hardware_read_byte();
        if (byte < 0) return;
        const node_phase before = own->phase;
        if (wire_take(&own->reader, (uint8_t)byte)) {
            if (!wire_is_notice(&own->reader)) session_take(own);
            else if (own->reader.bytes[1] == NOTICE_ASK) wire_send_notice(NOTICE_HERE);
        }
        if (byte == 0) wire_begin(&own->reader);
        if (before == NODE_GREETING && own->phase == NODE_FLYING)
            own->start_ns = hardware_now_ns() + LEAD_IN_NS - (uint64_t)own->tick * TERMS_TICK_NS;
    }
}

/* A tick */

static void measure(double *measured) {
    for (int output = 0; output < CODEC_OUTPUTS; output++) {
        const int32_t counts = hardware_read_encoder(output) - zero_counts[output];
        measured[output] = (double)sign[output] * (double)counts * turn[output] / counts_per_turn[output];
    }
}

static bool look(node *own, uint32_t tick, const double *outputs, double *measurement) {
#if CODEC_USES_RATES
    const bool is_expected = own->has_observed && tick == own->seen_tick + 1;
    if (!own->has_observed) {
        codec_state first;
        codec_initial(&first);
        memcpy(own->observed, first.model, sizeof first.model);
    }
    own->has_observed = true;
    if (!codec_look(own->observed, is_expected, outputs, own->last_due)) return false;
    memcpy(measurement, own->observed, CODEC_MEASURED * sizeof(double));
#else
    (void)own;
    (void)tick;
    memcpy(measurement, outputs, CODEC_MEASURED * sizeof(double));
#endif
    return true;
}

static void form_word(node *own, uint32_t sample, const double *measurement) {
    int32_t symbols[CODEC_SYMBOLS_PER_WORD];
    uint32_t number = 0;
    while (own->provisional.sample < sample) {
        const uint16_t word = own->sent[own->provisional.sample % (TERMS_HISTORY_SAMPLES + 1)];
        if (!session_step(own, &own->provisional, word)) {
            session_rejoin(own, WHY_LAG);
            return;
        }
    }
    if (!codec_encode(&own->provisional, measurement, symbols)) {
        session_rejoin(own, WHY_LAG);
        return;
    }
    for (int at = CODEC_SYMBOLS_PER_WORD - 1; at >= 0; at--) {
        uint8_t digit = 0;
        while (codec_alphabet[digit] != symbols[at]) digit++;
        own->symbols[at] = digit;
        number = number * CODEC_ALPHABET_SIZE + digit;
    }
    own->sent[sample % (TERMS_HISTORY_SAMPLES + 1)] = (uint16_t)number;
    own->next_sample = sample + 1;
    own->first_slot = sample * CODEC_SYMBOLS_PER_WORD;
    own->symbol_at = 0;
}

static void on_measurement(node *own, uint32_t tick, const double *measurement) {
    const uint32_t sample = tick / CODEC_TICKS_PER_SAMPLE;
    if (own->phase == NODE_REJOINING && tick >= own->next_ask_tick) {
        const uint32_t samples = ASK_AGAIN_NS > SAMPLE_NS ? (uint32_t)((ASK_AGAIN_NS + SAMPLE_NS - 1) / SAMPLE_NS) : 1;
        own->next_ask_tick = tick + samples * CODEC_TICKS_PER_SAMPLE;
        session_ask(own);
    }
    if (own->phase != NODE_FLYING) return;
    if (sample > own->confirmed.sample && sample - own->confirmed.sample > TERMS_HISTORY_SAMPLES) {
        session_rejoin(own, WHY_LAG);
        return;
    }
    while (own->next_sample < sample) /* samples that were missed had no word */
        own->sent[own->next_sample++ % (TERMS_HISTORY_SAMPLES + 1)] = WIRE_ERASED;
    if (tick % CODEC_TICKS_PER_SAMPLE == 0 && own->next_sample == sample) form_word(own, sample, measurement);
}

static void actuate(node *own, uint32_t tick) {
    double command[CODEC_INPUTS];
    const bool is_due = own->phase != NODE_ENDED && session_is_due(own, tick);
    if (own->phase == NODE_ENDED) guard_trip(&own->guard, GUARD_SESSION_ENDED);
    if (is_due) {
        session_command(own, tick, command);
        memcpy(own->last_due, command, sizeof command);
    } else if (own->phase == NODE_FLYING && tick >= own->epoch_tick && !guard_is_stopped(&own->guard)) {
        own->counts.commands_late++;
    }
    guard_apply(&own->guard, tick, is_due ? command : 0, session_owed_ticks(own, tick));
    for (int input = 0; input < CODEC_INPUTS; input++) hardware_write_motor(input, own->guard.command[input]);
    if (own->guard.state == GUARD_LATCHED && own->phase != NODE_ENDED) session_bye(own, ENDING_SAFETY_STOP);
}

static void fly_tick(node *own) {
    const uint32_t tick = own->tick;
    double outputs[CODEC_OUTPUTS], measurement[CODEC_ROOM(CODEC_MEASURED)];
    measure(outputs);
    guard_check_outputs(&own->guard, outputs);
    if (!look(own, tick, outputs, measurement)) guard_trip(&own->guard, GUARD_BAD_OUTPUT);
    own->seen_tick = tick;
    if (!guard_is_stopped(&own->guard)) on_measurement(own, tick, measurement);
    actuate(own, tick);
    own->counts.ticks++;
    own->tick++;
}

/* Symbols leave in their slots, at most one in each, and never later. */
static void send_symbol(node *own) {
    if (own->symbol_at >= CODEC_SYMBOLS_PER_WORD) return;
    const uint64_t slot = own->first_slot + own->symbol_at;
    const uint64_t begin = slot * SAMPLE_NS / CODEC_SYMBOLS_PER_WORD + TERMS_SYMBOL_DELAY_NS;
    const int64_t late = (int64_t)(hardware_now_ns() - own->start_ns - begin);
    if (late < 0) return;
    if (late < (int64_t)(SAMPLE_NS / CODEC_SYMBOLS_PER_WORD) && own->phase == NODE_FLYING
        && !guard_is_stopped(&own->guard)) {
        wire_send_symbol((uint32_t)slot, own->symbols[own->symbol_at]);
        own->counts.symbols_sent++;
    }
    own->symbol_at++;
}

void node_poll(node *own) {
    take_bytes(own);
    const uint64_t now = hardware_now_ns();
    if (own->phase == NODE_GREETING) {
        uint64_t period = SAMPLE_NS > ASK_AGAIN_NS ? SAMPLE_NS : ASK_AGAIN_NS;
        if (period > HELLO_PERIOD_NS_MAX) period = HELLO_PERIOD_NS_MAX;
        if (now - own->asked_ns < period) return;
        own->asked_ns = now;
        session_ask(own);
        return;
    }
    if (own->phase == NODE_ENDED && own->session == 0) return; /* refused before the first tick */
    send_symbol(own); /* one that is delivered at its slot's end leaves with the next sample */
    const int64_t late = (int64_t)(now - own->start_ns - (uint64_t)own->tick * TERMS_TICK_NS);
    if (late >= 0) {
        const uint32_t missed = (uint32_t)(late / TERMS_TICK_NS);
        own->counts.ticks_missed += missed;
        own->tick += missed;
        fly_tick(own);
    }
    send_symbol(own);
}
