/* The codec: coder and observer, one state machine, equal to that of channel/codec/codec.py to the last bit.
 *
 * Every function that returns a bool returns false where Python would raise an exception: the state is then
 * as it was, and the two ends need a common state again.
 */
#ifndef TENBAUD_CODEC_H
#define TENBAUD_CODEC_H

#include "arithmetic.h"
#include "codec_sizes.h"

/* Room for a sequence that may be empty: C has no arrays of size 0. */
#define CODEC_ROOM(size) ((size) > 0 ? (size) : 1)
#define CODEC_BYTES (8 + 8 * (CODEC_STATES + CODEC_CODER_STATES))

typedef struct {
    uint32_t sample; /* index of the next one */
    double model[CODEC_ROOM(CODEC_STATES)];
    double coder[CODEC_ROOM(CODEC_CODER_STATES)];
} codec_state;

extern const int32_t codec_alphabet[CODEC_ALPHABET_SIZE];

void codec_initial(codec_state *state);

/* The word for a measurement of CODEC_MEASURED numbers; CODEC_SYMBOLS_PER_WORD symbols of the alphabet. */
bool codec_encode(const codec_state *state, const double *measurement, int32_t *symbols);

/* One whole sample: its word, then the commands of its ticks, CODEC_INPUTS numbers for each. */
bool codec_step(codec_state *state, const int32_t *symbols, bool is_erased, const double *commands);

/* The same with CODEC_LEAD_TICKS commands more; `live` gets, for each tick of the sample, the state that the
 * command of the tick CODEC_LEAD_TICKS later is decided from. */
bool codec_fly(
    codec_state *state, const int32_t *symbols, bool is_erased, const double *commands, double *live);

#if CODEC_USES_RATES
/* The transmitter's observer at a tick; `command` was held since the one before, `is_expected` that this is
 * the tick after it. */
bool codec_look(double *state, bool is_expected, const double *measurement, const double *command);
#endif

/* The model as a plant: its state and outputs one tick later. `push` is added to the rates of the corrected
 * states, CODEC_CORRECTED numbers. For tests without a rig. */
bool codec_simulate(double *state, const double *command, const double *push, double *outputs);

/* Whether the model's state is finite and near enough for a flight. */
bool codec_is_estimate(const codec_state *state);

/* A command within +-largest, at most a step away from the one before. */
double codec_limited(double wanted, double before, double largest, double step);

/* The CODEC_BYTES canonical bytes of a state, and back; false for bytes of another codec, or numbers that are not finite. */
void codec_pack(const codec_state *state, uint8_t *bytes);
bool codec_unpack(codec_state *state, const uint8_t *bytes, uint32_t size);

uint64_t codec_digest(const codec_state *state);

/* Eight bytes that depend on every bit of this machine's arithmetic (channel/protocol/identity.py). */
bool codec_probe(uint8_t *probe);

#endif
