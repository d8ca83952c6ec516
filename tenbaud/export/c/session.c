/* What arrives at the node, and what it asks for (transmitter/session). */
#include "node.h"

enum { PAUSES_MAX = 4, REFUSALS_ACCEPTED = 3, SILENT_SAMPLES = 2 };
#define REACH_SAMPLES (2 * TERMS_HISTORY_SAMPLES)
#define LEAD_SAMPLES ((CODEC_LEAD_TICKS + CODEC_TICKS_PER_SAMPLE - 1) / CODEC_TICKS_PER_SAMPLE)

static const double initial_command[CODEC_INPUTS] = TERMS_INITIAL_COMMAND;
static const double steps_per_unit[CODEC_INPUTS] = TERMS_STEPS_PER_UNIT;
static const int32_t steps_max[CODEC_INPUTS] = TERMS_STEPS_MAX;
static const uint8_t config_digest[16] = TERMS_CONFIG_DIGEST;
static const char version[] = TERMS_VERSION;

static uint32_t sample_now(const node *own) { return own->seen_tick / CODEC_TICKS_PER_SAMPLE; }

static bool is_silent(const node *own) {
    return own->seen_tick - own->heard_tick >= SILENT_SAMPLES * CODEC_TICKS_PER_SAMPLE;
}

/* Sending */

static uint8_t *head(uint8_t *to, uint8_t kind, uint32_t session, uint16_t epoch) {
    to = wire_put(wire_put(to, WIRE_VERSION, 1), kind, 1);
    return wire_put(wire_put(to, session, 4), epoch, 2);
}

void session_ask(node *own) {
    uint8_t frame[64 + sizeof version + 2];
    const bool has_flown = own->phase != NODE_GREETING;
    uint8_t *end = head(frame, KIND_HELLO, own->session, own->epoch);
    end = wire_put(wire_put(end, own->incarnation, 4), own->request, 4);
    end = wire_put(end, has_flown ? sample_now(own) + 1 : 0, 4);
    end = wire_put(end, own->why, 1);
    memcpy(end, config_digest, 16);
    memcpy(end + 16, own->probe, 8);
    end = wire_put(end + 24, sizeof version - 1, 2);
    memcpy(end, version, sizeof version - 1);
    end += sizeof version - 1;
    wire_send(frame, (uint32_t)(end - frame));
}

static void report(uint64_t ours, uint64_t theirs, const node *own, const codec_state *after) {
    uint8_t frame[8 + 20 + CODEC_BYTES + 2];
    uint8_t *end = head(frame, KIND_DESYNC, own->session, own->epoch);
    end = wire_put(wire_put(wire_put(end, after->sample - 1, 4), ours, 8), theirs, 8);
    codec_pack(after, end);
    wire_send(frame, (uint32_t)(end + CODEC_BYTES - frame));
}

void session_bye(node *own, uint8_t ending) {
    uint8_t frame[16];
    /* To a refusal the answer has no session. */
    uint8_t *end = head(frame, KIND_BYE, own->is_refused ? 0 : own->session, 0);
    end = wire_put(wire_put(end, ending, 1), 0, 2);
    wire_send(frame, (uint32_t)(end - frame));
    own->ending = ending;
    own->phase = NODE_ENDED;
}

void session_rejoin(node *own, node_why why) {
    if (own->phase != NODE_FLYING) return;
    own->phase = NODE_REJOINING;
    own->why = why;
    own->request++;
    own->refusals = 0;
    own->next_ask_tick = own->seen_tick;
}

/* Commands */

static void command_at(const node *own, uint32_t tick, double *command) {
    const int16_t *steps = own->commands[tick % NODE_COMMANDS];
    for (int input = 0; input < CODEC_INPUTS; input++)
        command[input] =
            tick < own->decided_from_tick ? own->hold[input] : (double)steps[input] / steps_per_unit[input];
}

void session_command(const node *own, uint32_t tick, double *command) {
    command_at(own, tick < own->commands_end ? tick : own->commands_end - 1, command);
}

bool session_is_due(const node *own, uint32_t tick) {
    return tick >= own->due_from_tick && tick < own->due_end && own->commands_end - tick <= NODE_COMMANDS;
}

uint32_t session_owed_ticks(const node *own, uint32_t tick) {
    return tick >= own->owed_from_tick ? tick - own->owed_from_tick + 1 : 0;
}

bool session_step(const node *own, codec_state *state, uint16_t word) {
    int32_t symbols[CODEC_SYMBOLS_PER_WORD];
    double commands[CODEC_TICKS_PER_SAMPLE * CODEC_INPUTS];
    uint32_t number = word;
    for (int at = 0; at < CODEC_SYMBOLS_PER_WORD; at++) {
        symbols[at] = word == WIRE_ERASED ? 0 : codec_alphabet[number % CODEC_ALPHABET_SIZE];
        number /= CODEC_ALPHABET_SIZE;
    }
    for (uint32_t tick = 0; tick < CODEC_TICKS_PER_SAMPLE; tick++)
        session_command(own, state->sample * CODEC_TICKS_PER_SAMPLE + tick, commands + tick * CODEC_INPUTS);
    return codec_step(state, symbols, word == WIRE_ERASED, commands);
}

static bool are_allowed(const int16_t *steps) {
    for (int input = 0; input < CODEC_INPUTS; input++)
        if (steps[input] > steps_max[input] || steps[input] < -steps_max[input]) return false;
    return true;
}

/* Echoes */

static bool check_echoes(node *own, wire_fields fields, uint32_t sample, uint32_t count) {
    bool is_good = count >= 1 && count <= TERMS_REPEATS + 1 && wire_left(&fields) == count * ECHO_BYTES;
    for (uint32_t echo = 0; is_good && echo < count; echo++, sample++) {
        const uint32_t word = wire_number(&fields, 2);
        wire_long_number(&fields);
        for (uint32_t tick = 0; tick < CODEC_TICKS_PER_SAMPLE; tick++) {
            int16_t steps[CODEC_INPUTS];
            for (int input = 0; input < CODEC_INPUTS; input++)
                steps[input] = (int16_t)wire_number(&fields, 2);
            if (sample >= own->confirmed.sample) is_good = is_good && are_allowed(steps);
        }
        if (sample < own->confirmed.sample) continue;
        is_good = is_good && (word < CODEC_WORDS || word == WIRE_ERASED);
        if (sample >= own->next_sample) is_good = is_good && word == WIRE_ERASED;
    }
    return is_good;
}

static void confirm(node *own, wire_fields *fields) {
    const uint16_t word = (uint16_t)wire_number(fields, 2);
    const uint64_t theirs = wire_long_number(fields);
    codec_state after = own->confirmed;
    const uint32_t end = own->commands_end;
    for (uint32_t tick = end; tick < end + CODEC_TICKS_PER_SAMPLE; tick++)
        for (int input = 0; input < CODEC_INPUTS; input++)
            own->commands[tick % NODE_COMMANDS][input] = (int16_t)wire_number(fields, 2);
    own->commands_end += CODEC_TICKS_PER_SAMPLE;
    if (!session_step(own, &after, word)) {
        session_rejoin(own, WHY_LAG);
        return;
    }
    own->confirmed = own->provisional = after;
    if (own->next_sample < after.sample) own->next_sample = after.sample;
    own->counts.confirmed++;
    own->counts.digest_checks++;
    if (word == WIRE_ERASED) own->counts.erasures++;
    const uint64_t ours = codec_digest(&after);
    if (ours != theirs) {
        own->counts.desyncs++;
        report(ours, theirs, own, &after);
        session_rejoin(own, WHY_DESYNC);
        return;
    }
    own->pauses = 0;
    own->due_end = own->commands_end; /* only now: a receiver with another state must move no motor */
}

static void take_commands(node *own, wire_fields *fields) {
    const uint32_t last = wire_number(fields, 4), count = wire_number(fields, 1);
    if (last < own->confirmed.sample) {
        own->counts.stale_frames++;
        return;
    }
    const uint32_t first = last + 1 - count;
    if (last + 1 < count || last > sample_now(own) + REACH_SAMPLES || !check_echoes(own, *fields, first, count)) {
        own->counts.out_of_bounds++;
        return;
    }
    own->heard_tick = own->seen_tick;
    if (first > own->confirmed.sample) { /* nothing overtakes on a serial line: the ones before are lost */
        session_rejoin(own, WHY_GAP);
        return;
    }
    fields->at += (own->confirmed.sample - first) * ECHO_BYTES;
    while (own->phase == NODE_FLYING && wire_left(fields) >= ECHO_BYTES) confirm(own, fields);
}

/* Answers */

static bool read_start(const node *own, wire_fields *fields, codec_state *state, double *hold) {
    const uint32_t first = wire_number(fields, 4);
    const uint32_t inputs = wire_number(fields, 1);
    const uint32_t latest = sample_now(own) + REACH_SAMPLES + LEAD_SAMPLES;
    if (first > (own->phase == NODE_GREETING ? TERMS_SAMPLE_MAX / 3 * 2 : latest)) return false;
    if (first > TERMS_SAMPLE_MAX || (inputs != 0 && inputs != CODEC_INPUTS)) return false;
    memcpy(hold, initial_command, sizeof initial_command);
    for (uint32_t input = 0; input < inputs; input++) {
        const int16_t steps = (int16_t)wire_number(fields, 2);
        if (steps > steps_max[input] || steps < -steps_max[input]) return false;
        hold[input] = (double)steps / steps_per_unit[input];
    }
    if (fields->is_short) return false;
    codec_initial(state);
    state->sample = first;
    if (wire_left(fields) == 0) return true;
    return codec_unpack(state, fields->bytes + fields->at, wire_left(fields)) && state->sample == first
        && codec_is_estimate(state);
}

/* The tick from which commands are owed, and whether the first ones may be held (transmitter/session/owing.py). */
static bool begin_owing(node *own) {
    if (own->why == WHY_START) own->pauses = 0;
    if (own->pauses >= PAUSES_MAX) return false;
    own->pauses++;
    const uint32_t next = (own->seen_tick / CODEC_TICKS_PER_SAMPLE + 1) * CODEC_TICKS_PER_SAMPLE;
    const uint32_t latest = next + CODEC_LEAD_TICKS + CODEC_TICKS_PER_SAMPLE;
    uint32_t from = own->epoch_tick;
    if (own->why != WHY_START) {
        if (from < next) from = next;
        if (from > latest) from = latest;
    }
    own->owed_from_tick = from + CODEC_LEAD_TICKS;
    return true;
}

static void take_welcome(node *own, wire_fields *fields, uint32_t session, uint16_t epoch) {
    const bool is_ours = wire_number(fields, 4) == own->incarnation;
    const bool is_answer = wire_number(fields, 4) == own->request && is_ours;
    const bool is_newer = session == own->session && epoch > own->epoch;
    const bool flies = own->phase == NODE_FLYING;
    if (own->phase == NODE_ENDED || session == 0 || (flies && !is_newer) || !(is_answer || (flies && is_ours))) {
        own->counts.stale_frames++;
        return;
    }
    if (!is_answer) { /* another end was answered in our name */
        if (is_silent(own)) session_rejoin(own, WHY_UNKNOWN);
        return;
    }
    codec_state state;
    double hold[CODEC_INPUTS];
    if (!read_start(own, fields, &state, hold)) {
        own->counts.out_of_bounds++;
        return;
    }
    const bool is_first = own->phase == NODE_GREETING;
    if (!is_first) own->counts.rejoins++;
    own->session = session;
    own->epoch = epoch;
    own->confirmed = own->provisional = state;
    own->next_sample = state.sample;
    memcpy(own->hold, hold, sizeof hold);
    own->epoch_tick = state.sample * CODEC_TICKS_PER_SAMPLE;
    own->decided_from_tick = own->commands_end = own->due_end = own->epoch_tick + CODEC_LEAD_TICKS;
    if (is_first) own->tick = own->seen_tick = own->epoch_tick;
    own->heard_tick = own->seen_tick;
    own->due_from_tick = begin_owing(own) ? own->epoch_tick : own->due_end;
    own->symbol_at = CODEC_SYMBOLS_PER_WORD;
    own->phase = NODE_FLYING;
}

static void take_refusal(node *own, wire_fields *fields) {
    const bool is_ours = wire_number(fields, 4) == own->incarnation;
    const uint8_t ending = (uint8_t)wire_number(fields, 1);
    if (!is_ours || fields->is_short) return;
    if (own->phase == NODE_REJOINING && ++own->refusals < REFUSALS_ACCEPTED) return;
    if (own->phase != NODE_GREETING && own->phase != NODE_REJOINING) return;
    own->is_refused = true;
    session_bye(own, ending);
}

void session_take(node *own) {
    const wire_reader *reader = &own->reader;
    const uint32_t there = reader->size < FRAME_BYTES_MAX ? reader->size : FRAME_BYTES_MAX;
    wire_fields fields = {reader->bytes, there, 0, false};
    const uint32_t its_version = wire_number(&fields, 1), kind = wire_number(&fields, 1);
    const uint32_t session = wire_number(&fields, 4);
    const uint16_t epoch = (uint16_t)wire_number(&fields, 2);
    if (fields.is_short) return;
    if (its_version != WIRE_VERSION) {
        if (own->phase == NODE_GREETING) {
            own->is_refused = true;
            session_bye(own, ENDING_WIRE_VERSION);
        }
        return;
    }
    const bool is_whole = reader->size <= FRAME_BYTES_MAX;
    const bool is_current = own->phase == NODE_FLYING && session == own->session && epoch == own->epoch;
    if (kind == KIND_COMMANDS && is_current && is_whole) {
        take_commands(own, &fields);
    } else if (kind == KIND_WELCOME && is_whole) {
        take_welcome(own, &fields, session, epoch);
    } else if (kind == KIND_UNKNOWN && is_current) {
        if (is_silent(own)) session_rejoin(own, WHY_UNKNOWN);
    } else if (kind == KIND_REFUSE) {
        take_refusal(own, &fields);
    } else if (kind == KIND_BYE && own->session != 0 && session == own->session && own->phase != NODE_ENDED) {
        own->ending = (uint8_t)wire_number(&fields, 1);
        own->phase = NODE_ENDED;
    } else {
        own->counts.stale_frames++;
    }
}
