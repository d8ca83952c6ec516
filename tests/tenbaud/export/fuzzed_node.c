/* The node with standard input as its line: a millisecond passes between two polls. */
#include <stdio.h>

#include "hardware.h"
#include "node.h"

static uint64_t now_ns = 5000000000u;
static uint32_t noise = 1;
static int is_over;

uint64_t hardware_now_ns(void) { return now_ns; }
int32_t hardware_read_encoder(int output) {
    noise = noise * 1103515245u + 12345u;
    return (int32_t)(noise >> 20) % 200 + output;
}
void hardware_write_motor(int input, double value) {
    if (!(value >= -5.0 && value <= 5.0)) printf("motor %d has %g V\n", input, value);
}
int hardware_read_byte(void) {
    int byte = is_over ? EOF : getchar();
    if (byte == 0xFF) byte = getchar() ? 0xFF : -1; /* 0xFF, 0: nothing has come yet */
    if (feof(stdin)) is_over = 1;
    return is_over ? -1 : byte;
}
void hardware_write_byte(uint8_t byte) { (void)byte; }

int main(void) {
    static node own;
    uint32_t confirmed = 0, ticks = 0, sessions = 0;
    node_begin(&own, 1234);
    while (!is_over) {
        const node_phase before = own.phase;
        node_poll(&own);
        now_ns += 1000000u;
        sessions += before != NODE_FLYING && own.phase == NODE_FLYING;
        if (own.phase != NODE_ENDED || (own.session != 0 && own.guard.state != GUARD_LATCHED)) continue;
        confirmed += own.counts.confirmed;
        ticks += own.counts.ticks;
        node_begin(&own, 1234);
    }
    printf("%u %u %u\n", sessions, ticks + own.counts.ticks, confirmed + own.counts.confirmed);
    return 0;
}
