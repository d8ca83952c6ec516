/* The guard beside the motors: limiter and watchdog (transmitter/guard.py). */
#ifndef TENBAUD_GUARD_H
#define TENBAUD_GUARD_H

#include <stdbool.h>
#include <stdint.h>

#include "codec.h"

typedef enum { GUARD_READY, GUARD_RUNNING, GUARD_HOLDING, GUARD_RAMPING, GUARD_LATCHED } guard_state;
typedef enum { GUARD_NONE, GUARD_TIMED_OUT, GUARD_SESSION_ENDED, GUARD_BAD_OUTPUT, GUARD_BAD_COMMAND } guard_cause;

typedef struct {
    guard_state state;
    guard_cause cause;
    double command[CODEC_INPUTS]; /* what is applied */
    double ramp_from[CODEC_INPUTS];
    uint32_t age_ticks;
    uint32_t ramp_tick;
    uint32_t tick; /* the last one applied */
    bool has_tick;
} guard;

void guard_begin(guard *own);
bool guard_is_stopped(const guard *own);
/* Ramps the command down from now on. */
void guard_trip(guard *own, guard_cause cause);
/* Trips where an output is beyond its soft limit, or not a number. */
void guard_check_outputs(guard *own, const double *measured);
/* The command of a tick; null where none has come. `owed_ticks`: ticks up to this one for which one was due. */
void guard_apply(guard *own, uint32_t tick, const double *command, uint32_t owed_ticks);

#endif
