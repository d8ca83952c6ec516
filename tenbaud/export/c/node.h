/* The sensor node: it measures, sends a byte for each symbol, checks every echo and moves the motors.
 *
 * The protocol is that of transmitter/session/session.py with the downlink "full". Call node_poll() as often
 * as possible; it never waits.
 */
#ifndef TENBAUD_NODE_H
#define TENBAUD_NODE_H

#include "codec.h"
#include "guard.h"
#include "terms.h"
#include "wire.h"

typedef enum { NODE_GREETING, NODE_FLYING, NODE_REJOINING, NODE_ENDED } node_phase;
enum { ENDING_SAFETY_STOP = 6, ENDING_WIRE_VERSION = 7 }; /* channel/protocol/endings.py */
typedef enum { WHY_START, WHY_DESYNC, WHY_GAP, WHY_LAG, WHY_UNKNOWN } node_why;

/* Commands that are kept: those of the confirmed sample's ticks, the lead, and ticks already passed. */
#define NODE_COMMANDS (CODEC_LEAD_TICKS + 4 * CODEC_TICKS_PER_SAMPLE)

typedef struct {
    uint32_t confirmed, digest_checks, desyncs, rejoins, erasures, symbols_sent;
    uint32_t ticks, ticks_missed, commands_late, out_of_bounds, stale_frames;
} node_counts;

typedef struct {
    node_phase phase;
    node_why why; /* of the last request */
    uint8_t ending; /* what the receiver said (channel/protocol/endings.py), 0 while there is none */
    bool is_refused;
    node_counts counts;
    guard guard;

    uint32_t incarnation, request, session;
    uint8_t probe[8];
    uint16_t epoch;
    uint8_t refusals, pauses;

    codec_state confirmed;
    codec_state provisional;
    uint16_t sent[TERMS_HISTORY_SAMPLES + 1]; /* words of the samples from the confirmed one on, by sample */
    uint32_t next_sample;
    int16_t commands[NODE_COMMANDS][CODEC_INPUTS]; /* steps, by tick */
    double hold[CODEC_INPUTS]; /* the command of the ticks before `decided_from_tick` */
    uint32_t decided_from_tick, commands_end;
    uint32_t due_from_tick, due_end; /* ticks whose commands may move the motors */
    double last_due[CODEC_INPUTS];
    double observed[CODEC_ROOM(CODEC_STATES)];
    bool has_observed;

    uint64_t start_ns, asked_ns;
    uint32_t tick; /* the next one */
    uint32_t seen_tick, epoch_tick, heard_tick, owed_from_tick, next_ask_tick;
    uint8_t symbols[CODEC_SYMBOLS_PER_WORD]; /* of the sample that is being sent */
    uint32_t symbol_at, first_slot;

    wire_reader reader;
} node;

/* Of session.c, for node.c. */
void session_take(node *own);
void session_rejoin(node *own, node_why why);
void session_ask(node *own);
void session_bye(node *own, uint8_t ending);
/* The command of a tick as the codec has it; the last one known where it has not come. */
void session_command(const node *own, uint32_t tick, double *command);
bool session_is_due(const node *own, uint32_t tick);
uint32_t session_owed_ticks(const node *own, uint32_t tick);
/* Steps a state over its next sample. */
bool session_step(const node *own, codec_state *state, uint16_t word);

/* `incarnation`: another number at every start, drawn at random. */
void node_begin(node *own, uint32_t incarnation);
void node_poll(node *own);

#endif
