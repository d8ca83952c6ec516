#include "guard.h"

#include "terms.h"

static const double safe[CODEC_INPUTS] = TERMS_SAFE_COMMAND;
static const double command_max[CODEC_INPUTS] = TERMS_COMMAND_MAX;
static const double slew_per_tick[CODEC_INPUTS] = TERMS_SLEW_PER_TICK;
static const double soft_limits[CODEC_OUTPUTS] = TERMS_SOFT_LIMITS;

void guard_begin(guard *own) {
    own->state = GUARD_READY;
    own->cause = GUARD_NONE;
    memcpy(own->command, safe, sizeof safe);
    own->age_ticks = own->ramp_tick = own->tick = 0;
    own->has_tick = false;
}

bool guard_is_stopped(const guard *own) {
    return own->state == GUARD_RAMPING || own->state == GUARD_LATCHED;
}

void guard_trip(guard *own, guard_cause cause) {
    if (!guard_is_stopped(own)) {
        own->state = GUARD_RAMPING;
        own->cause = cause;
        memcpy(own->ramp_from, own->command, sizeof own->command);
        own->ramp_tick = 0;
    } else if (own->cause == GUARD_TIMED_OUT) {
        own->cause = cause; /* something worse than silence */
    }
}

void guard_check_outputs(guard *own, const double *measured) {
    for (int output = 0; output < CODEC_OUTPUTS; output++) {
        const double value = measured[output], most = soft_limits[output];
        if (!arithmetic_is_finite(value) || value > most || value < -most) guard_trip(own, GUARD_BAD_OUTPUT);
    }
}

static void take(guard *own, uint32_t tick, const double *command, uint32_t owed_ticks) {
    if (command) {
        own->state = GUARD_RUNNING;
        own->age_ticks = 0;
        for (int input = 0; input < CODEC_INPUTS; input++)
            own->command[input] = codec_limited(
                command[input], own->command[input], command_max[input], slew_per_tick[input]);
        return;
    }
    /* Ticks that were missed pass as well: the watchdog counts time. */
    own->age_ticks += own->has_tick ? tick - own->tick : 1;
    if (own->age_ticks > owed_ticks) own->age_ticks = owed_ticks;
    if (own->state == GUARD_RUNNING) own->state = GUARD_HOLDING;
    if (own->age_ticks > TERMS_TIMEOUT_TICKS) guard_trip(own, GUARD_TIMED_OUT);
}

void guard_apply(guard *own, uint32_t tick, const double *command, uint32_t owed_ticks) {
    for (int input = 0; command && input < CODEC_INPUTS; input++)
        if (!arithmetic_is_finite(command[input])) guard_trip(own, GUARD_BAD_COMMAND);
    if (!guard_is_stopped(own)) take(own, tick, command, owed_ticks);
    if (own->state == GUARD_RAMPING) {
        const double left = 1.0 - (double)++own->ramp_tick / (double)TERMS_RAMP_TICKS;
        if (left <= 0.0) own->state = GUARD_LATCHED;
        for (int input = 0; input < CODEC_INPUTS; input++)
            own->command[input] =
                left > 0.0 ? safe[input] + (own->ramp_from[input] - safe[input]) * left : safe[input];
    }
    own->tick = tick;
    own->has_tick = true;
}
