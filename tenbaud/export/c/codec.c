#include "codec.h"

#include "blake2b.h"
#include "codec_program.h"

static const double initial_model[] = CODEC_INITIAL_MODEL;
static const double initial_coder[] = CODEC_INITIAL_CODER;
const int32_t codec_alphabet[CODEC_ALPHABET_SIZE] = CODEC_ALPHABET;

void codec_initial(codec_state *state) {
    state->sample = 0;
    memcpy(state->model, initial_model, CODEC_STATES * sizeof(double));
    memcpy(state->coder, initial_coder, CODEC_CODER_STATES * sizeof(double));
}

bool codec_encode(const codec_state *state, const double *measurement, int32_t *symbols) {
    arithmetic_fault = false;
    entry_encode(state->model, state->coder, measurement, symbols);
    return !arithmetic_fault;
}

static bool taken(codec_state *state, bool is_estimate, const double *model, const double *coder) {
    if (!is_estimate || arithmetic_fault) return false;
    state->sample++;
    memcpy(state->model, model, CODEC_STATES * sizeof(double));
    memcpy(state->coder, coder, CODEC_CODER_STATES * sizeof(double));
    return true;
}

bool codec_step(codec_state *state, const int32_t *symbols, bool is_erased, const double *commands) {
    double model[CODEC_ROOM(CODEC_STATES)], coder[CODEC_ROOM(CODEC_CODER_STATES)];
    arithmetic_fault = false;
    const bool is_good =
        entry_step(state->model, state->coder, symbols, is_erased, commands, model, coder);
    return taken(state, is_good, model, coder);
}

bool codec_fly(
    codec_state *state, const int32_t *symbols, bool is_erased, const double *commands, double *live) {
    double model[CODEC_ROOM(CODEC_STATES)], coder[CODEC_ROOM(CODEC_CODER_STATES)];
    arithmetic_fault = false;
    const bool is_good =
        entry_fly(state->model, state->coder, symbols, is_erased, commands, model, coder, live);
    return taken(state, is_good, model, coder);
}

#if CODEC_USES_RATES
bool codec_look(double *state, bool is_expected, const double *measurement, const double *command) {
    double after[CODEC_STATES];
    arithmetic_fault = false;
    entry_look(state, is_expected, measurement, command, after);
    if (arithmetic_fault) return false;
    memcpy(state, after, sizeof after);
    return true;
}
#endif

bool codec_simulate(double *state, const double *command, const double *push, double *outputs) {
    double after[CODEC_STATES];
    arithmetic_fault = false;
    entry_simulate(state, command, push, after, outputs);
    if (arithmetic_fault) return false;
    memcpy(state, after, sizeof after);
    return true;
}

bool codec_is_estimate(const codec_state *state) { return entry_is_estimate(state->model); }

double codec_limited(double wanted, double before, double largest, double step) {
    return entry_limited(wanted, before, largest, step);
}

static void put_double(uint8_t *bytes, double value) {
    uint64_t bits;
    value += 0.0; /* no minus zero */
    memcpy(&bits, &value, sizeof bits);
    for (int at = 0; at < 8; at++) bytes[at] = (uint8_t)(bits >> 8 * at);
}

void codec_pack(const codec_state *state, uint8_t *bytes) {
    for (int at = 0; at < 8; at++) bytes[at] = at < 4 ? (uint8_t)(state->sample >> 8 * at) : 0;
    for (int at = 0; at < CODEC_STATES; at++) put_double(bytes + 8 + 8 * at, state->model[at]);
    for (int at = 0; at < CODEC_CODER_STATES; at++)
        put_double(bytes + 8 + 8 * (CODEC_STATES + at), state->coder[at]);
}

static bool take_double(const uint8_t *bytes, double *value) {
    uint64_t bits = 0;
    for (int at = 0; at < 8; at++) bits |= (uint64_t)bytes[at] << 8 * at;
    memcpy(value, &bits, sizeof bits);
    return arithmetic_is_finite(*value);
}

bool codec_unpack(codec_state *state, const uint8_t *bytes, uint32_t size) {
    codec_state read;
    bool is_good = size == CODEC_BYTES;
    if (!is_good) return false;
    for (int at = 4; at < 8; at++) is_good = is_good && bytes[at] == 0;
    read.sample = bytes[0] | (uint32_t)bytes[1] << 8 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[3] << 24;
    for (int at = 0; at < CODEC_STATES; at++)
        is_good = take_double(bytes + 8 + 8 * at, &read.model[at]) && is_good;
    for (int at = 0; at < CODEC_CODER_STATES; at++)
        is_good = take_double(bytes + 8 + 8 * (CODEC_STATES + at), &read.coder[at]) && is_good;
    if (is_good) *state = read;
    return is_good;
}

uint64_t codec_digest(const codec_state *state) {
    uint8_t bytes[CODEC_BYTES], digest[8];
    uint64_t number = 0;
    codec_pack(state, bytes);
    blake2b(digest, 8, bytes, sizeof bytes);
    for (int at = 7; at >= 0; at--) number = number << 8 | digest[at];
    return number;
}

static uint32_t noise_after(uint32_t noise) { return (noise * 1103515245u + 12345u) & 0x7FFFFFFFu; }

bool codec_probe(uint8_t *probe) {
    blake2b_state digest;
    uint8_t bytes[CODEC_BYTES];
    blake2b_begin(&digest, 8);
    for (int point = -200; point < 200; point++) {
        double numbers[3];
        arithmetic_fault = false;
        entry_numbers(point * 0.0537109375, numbers);
        for (int at = 0; at < 3; at++) {
            put_double(bytes, numbers[at]);
            blake2b_add(&digest, bytes, 8);
        }
    }
    codec_state state;
    codec_initial(&state);
    uint32_t noise = 1;
    for (uint32_t sample = 0; sample < 40; sample++) {
        int32_t symbols[CODEC_SYMBOLS_PER_WORD];
        double commands[CODEC_TICKS_PER_SAMPLE * CODEC_INPUTS];
        for (int at = 0; at < CODEC_SYMBOLS_PER_WORD; at++) {
            noise = noise_after(noise);
            symbols[at] = sample % 7 == 6 ? 0 : codec_alphabet[(noise >> 16) % CODEC_ALPHABET_SIZE];
        }
        for (int tick = 0; tick < CODEC_TICKS_PER_SAMPLE; tick++) {
            noise = noise_after(noise);
            const double value = ((int32_t)((noise >> 12) % 9001u) - 4500) / 1000.0;
            for (int input = 0; input < CODEC_INPUTS; input++)
                commands[tick * CODEC_INPUTS + input] = input % 2 == 0 ? value : -1.0 * value;
        }
        if (!codec_step(&state, symbols, sample % 7 == 6, commands)) {
            if (arithmetic_fault) return false;
            codec_initial(&state);
            state.sample = sample + 1;
        }
        codec_pack(&state, bytes);
        blake2b_add(&digest, bytes, sizeof bytes);
    }
    blake2b_end(&digest, probe);
    return true;
}
