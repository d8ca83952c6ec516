/* The node on an emulated Cortex-M3: UART 0 is the line, UART 1 has a line of counts every second. */
#include "board.h"

#include "../hardware.h"
#include "../simulated/rig.h"

enum { MEASURED_SAMPLES = 20 };

uint64_t hardware_now_ns(void) {
    static uint32_t before = SYSTICK_MAX;
    static uint64_t counts;
    const uint32_t value = SYSTICK_VALUE;
    counts += (before - value) & SYSTICK_MAX; /* called more often than once in 1.3 s */
    before = value;
    return counts * NS_PER_COUNT;
}

int hardware_read_byte(void) {
    if (UART_FLAGS(0) & FLAG_NOTHING_RECEIVED) return -1;
    return (int)(UART_DATA(0) & 0xFFu);
}

void hardware_write_byte(uint8_t byte) {
    while (UART_FLAGS(0) & FLAG_NO_ROOM) continue;
    UART_DATA(0) = byte;
}

static void put(char one) {
    while (UART_FLAGS(1) & FLAG_NO_ROOM) continue;
    UART_DATA(1) = (uint32_t)one;
}

extern uint32_t bss_end[], stack_top[];

static uint32_t deepest_stack(void) {
    const uint32_t *at = bss_end;
    while (at < stack_top && *at == STACK_UNUSED) at++;
    return (uint32_t)(stack_top - at) * 4u;
}

/* How long the codec takes; with -icount shift=0 a nanosecond is an instruction. */
static void measure(void) {
    static const double commands[CODEC_TICKS_PER_SAMPLE * CODEC_INPUTS];
    codec_state state;
    double measurement[CODEC_ROOM(CODEC_MEASURED)] = {0.01};
    int32_t symbols[CODEC_SYMBOLS_PER_WORD];
    uint64_t encode_ns = 0, step_ns = 0, digest_ns = 0;
    codec_initial(&state);
    for (int sample = 0; sample < MEASURED_SAMPLES; sample++) {
        const uint64_t first = hardware_now_ns();
        codec_encode(&state, measurement, symbols);
        const uint64_t second = hardware_now_ns();
        if (!codec_step(&state, symbols, false, commands)) codec_initial(&state);
        const uint64_t third = hardware_now_ns();
        codec_digest(&state);
        digest_ns += hardware_now_ns() - third;
        step_ns += third - second;
        encode_ns += second - first;
    }
    uint8_t probe[8];
    codec_probe(probe);
    put('{');
    rig_report_number("stack_bytes", deepest_stack(), put);
    rig_report_number("encode_ns", (uint32_t)(encode_ns / MEASURED_SAMPLES), put);
    rig_report_number("step_ns", (uint32_t)(step_ns / MEASURED_SAMPLES), put);
    rig_report_number("tick_ns", (uint32_t)(step_ns / MEASURED_SAMPLES / CODEC_TICKS_PER_SAMPLE), put);
    rig_report_number("digest_ns", (uint32_t)(digest_ns / MEASURED_SAMPLES), put);
    rig_report_number("node_bytes", sizeof(node), put);
    put('"');
    for (const char *text = "samples\": 20}\n"; *text; text++) put(*text);
}

int main(void) {
    static node own;
    SYSTICK_LOAD = SYSTICK_MAX;
    SYSTICK_VALUE = 0;
    SYSTICK_CONTROL = 5; /* counts, with the processor's clock */
    for (int number = 0; number < 2; number++) {
        UART_LINE(number) = 0x70; /* 8 bits, with its queues */
        UART_CONTROL(number) = 0x301;
    }
    measure();
    rig_begin();
    for (uint32_t start = 1;; start++) {
        uint64_t reported_ns = hardware_now_ns();
        /* No source of chance: the time to here differs, and a board of yours has a serial number. */
        node_begin(&own, (uint32_t)reported_ns * 2654435761u ^ SYSTICK_VALUE ^ start << 24);
        while (own.phase != NODE_ENDED || (own.session != 0 && own.guard.state != GUARD_LATCHED)) {
            node_poll(&own);
            if (hardware_now_ns() - reported_ns >= 1000000000u) {
                reported_ns += 1000000000u;
                rig_report(&own, put);
            }
        }
        rig_report(&own, put);
        /* A stop for safety lasts until the reset; otherwise the receiver may fly again, or another one. */
        if (own.ending == ENDING_SAFETY_STOP) return 0;
        const uint64_t ended_ns = hardware_now_ns();
        while (hardware_now_ns() - ended_ns < 1000000000u) continue;
    }
}
