/* From the reset to main: memory, and what C expects of a library. */
#include <stddef.h>
#include <stdint.h>

#include "board.h"

extern uint32_t data_begin[], data_end[], data_stored[], bss_begin[], bss_end[], stack_top[];
int main(void);

/* Else GCC makes calls of these very functions of their loops. */
#pragma GCC optimize("no-tree-loop-distribute-patterns")

void *memcpy(void *to, const void *from, size_t count) {
    uint8_t *target = to;
    const uint8_t *source = from;
    while (count--) *target++ = *source++;
    return to;
}

void *memset(void *to, int value, size_t count) {
    uint8_t *target = to;
    while (count--) *target++ = (uint8_t)value;
    return to;
}

static void reset(void) {
    const uint32_t *stored = data_stored;
    for (uint32_t *at = data_begin; at < data_end; at++) *at = *stored++;
    for (uint32_t *at = bss_begin; at < bss_end; at++) *at = 0;
    /* Memory that the stack has not reached keeps this, so that its depth can be told. */
    for (uint32_t *at = bss_end; at < (uint32_t *)__builtin_frame_address(0) - 32; at++) *at = STACK_UNUSED;
    main();
    for (;;) continue;
}

/* A fault of the processor: nothing moves any more until the reset. */
static void halt(void) {
    for (;;) continue;
}

/* A board that uses interrupts has a function of this name. */
__attribute__((weak, alias("halt"))) void interrupt(void);

__attribute__((section(".vectors"), used)) static const void *const vectors[16 + 96] = {
    stack_top, reset, halt, halt, halt, halt, halt, 0, 0, 0, 0, halt, halt, 0, halt, halt,
    [16 ... 111] = interrupt};
