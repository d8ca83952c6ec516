#include "rig.h"

#include "../hardware.h"

#define PUSH_NS 2000000000u

static const double counts_per_turn[CODEC_OUTPUTS] = TERMS_COUNTS_PER_TURN;
static const double turn[CODEC_OUTPUTS] = TERMS_TURN;
static const int32_t sign[CODEC_OUTPUTS] = TERMS_SIGN;
static const int32_t zero_counts[CODEC_OUTPUTS] = TERMS_ZERO_COUNTS;

static double plant[CODEC_ROOM(CODEC_STATES)], outputs[CODEC_OUTPUTS], command[CODEC_INPUTS];
static uint64_t began_ns, ticks;

void rig_begin(void) {
    codec_state first;
    codec_initial(&first);
    memcpy(plant, first.model, sizeof plant);
    began_ns = hardware_now_ns();
}

/* The plant is the model and a push, now this way and now that, that the model does not know. */
static void advance(void) {
    double push[CODEC_ROOM(CODEC_CORRECTED)];
    for (int at = 0; at < CODEC_CORRECTED; at++) push[at] = 0.0;
    const uint64_t due = (hardware_now_ns() - began_ns) / TERMS_TICK_NS;
    for (; ticks < due; ticks++) {
        push[CODEC_CORRECTED - 1] = ticks * TERMS_TICK_NS / PUSH_NS % 2 ? 0.02 : -0.02;
        codec_simulate(plant, command, push, outputs); /* one that cannot go on stays as it is */
    }
}

int32_t hardware_read_encoder(int output) {
    advance();
    const double counts = outputs[output] / turn[output] * counts_per_turn[output];
    return sign[output] * arithmetic_floor(counts + 0.5) + zero_counts[output];
}

void hardware_write_motor(int input, double value) {
    advance();
    command[input] = value;
}

static void put_text(const char *text, void (*put)(char)) {
    while (*text) put(*text++);
}

static void put_number(uint32_t number, void (*put)(char)) {
    char digits[10];
    int count = 0;
    do {
        digits[count++] = (char)('0' + number % 10);
        number /= 10;
    } while (number);
    while (count) put(digits[--count]);
}

void rig_report_number(const char *name, uint32_t number, void (*put)(char)) {
    put_text("\"", put);
    put_text(name, put);
    put_text("\": ", put);
    put_number(number, put);
    put_text(", ", put);
}

void rig_report(const node *own, void (*put)(char)) {
    const node_counts *counts = &own->counts;
    const uint64_t digest = codec_digest(&own->confirmed);
    put('{');
    rig_report_number("phase", own->phase, put);
    rig_report_number("ending", own->ending, put);
    rig_report_number("refused", own->is_refused, put);
    rig_report_number("guard", own->guard.state, put);
    rig_report_number("epoch", own->epoch, put);
    rig_report_number("sample", own->confirmed.sample, put);
    rig_report_number("confirmed", counts->confirmed, put);
    rig_report_number("digest_checks", counts->digest_checks, put);
    rig_report_number("desyncs", counts->desyncs, put);
    rig_report_number("rejoins", counts->rejoins, put);
    rig_report_number("erasures", counts->erasures, put);
    rig_report_number("symbols", counts->symbols_sent, put);
    rig_report_number("ticks", counts->ticks, put);
    rig_report_number("ticks_missed", counts->ticks_missed, put);
    rig_report_number("commands_late", counts->commands_late, put);
    rig_report_number("out_of_bounds", counts->out_of_bounds, put);
    rig_report_number("stale_frames", counts->stale_frames, put);
    put_text("\"digest\": \"", put);
    for (int shift = 60; shift >= 0; shift -= 4) put("0123456789abcdef"[digest >> shift & 15u]);
    put_text("\"}\n", put);
}
