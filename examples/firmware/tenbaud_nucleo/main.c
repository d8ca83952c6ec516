/* The sensor node on an STM32 Nucleo-F446RE: encoder, two motors, and the serial line of the board's USB.
 *
 *   PA0, PA1   encoder A and B (timer 2, pull-ups on)        PB0   direction of the front motor, high: negative
 *   PA6, PA7   PWM of front and rear motor, 20 kHz (timer 3) PB1   direction of the rear motor
 *   PA2, PA3   USART2, which the ST-Link passes on to USB
 *
 * For one output and two inputs, as the pitch presets have them.
 */
#include "hardware.h"
#include "node.h"

#ifndef CLOCK_HZ
#define CLOCK_HZ 16000000u /* the internal oscillator: nothing has to be set up */
#endif
#ifndef SUPPLY_VOLTS
#define SUPPLY_VOLTS 12.0 /* of the amplifier: at full PWM the motor has this */
#endif
#ifndef CHIP_NUMBER
#define CHIP_NUMBER 0x1FFF7A10u
#endif
#define LINE_BAUD 115200u
#define PWM_STEPS 800u
#define RING 1024u /* a power of two, more than a frame */

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define RCC_AHB1ENR REGISTER(0x40023830u)
#define RCC_APB1ENR REGISTER(0x40023840u)
#define GPIO(port, at) REGISTER(0x40020000u + 0x400u * (port) + (at))
#define TIM2(at) REGISTER(0x40000000u + (at))
#define TIM3(at) REGISTER(0x40000400u + (at))
#define USART2_SR REGISTER(0x40004400u)
#define USART2_DR REGISTER(0x40004404u)
#define USART2_BRR REGISTER(0x40004408u)
#define USART2_CR1 REGISTER(0x4000440Cu)
#define NVIC_ISER1 REGISTER(0xE000E104u)
#define SYSTICK(at) REGISTER(0xE000E010u + (at))

enum { MODER = 0x00, PUPDR = 0x0C, BSRR = 0x18, AFRL = 0x20 };
enum { CR1 = 0x00, SMCR = 0x08, EGR = 0x14, CCMR1 = 0x18, CCER = 0x20, CNT = 0x24, ARR = 0x2C, CCR1 = 0x34 };
enum { ORE = 1 << 3, RXNE = 1 << 5, TXE = 1 << 7, RXNEIE = 1 << 5, SYSTICK_MAX = 0xFFFFFF };

typedef struct {
    volatile uint8_t bytes[RING];
    volatile uint32_t in, out;
} ring;

static ring received, sending;

/* The only interrupt that is enabled: the USART has room for a single byte, and a sample takes longer. */
void interrupt(void) {
    const uint32_t status = USART2_SR;
    if (status & (RXNE | ORE)) { /* reading the data ends an overrun as well */
        const uint8_t byte = (uint8_t)USART2_DR;
        if ((status & RXNE) && received.in - received.out < RING) received.bytes[received.in++ % RING] = byte;
    }
}

int hardware_read_byte(void) {
    return received.in == received.out ? -1 : received.bytes[received.out++ % RING];
}

void hardware_write_byte(uint8_t byte) {
    if (sending.in - sending.out >= RING) return;
    sending.bytes[sending.in++ % RING] = byte;
}

/* Whatever waits leaves a byte at a time, between two calls of the node. */
static void send(void) {
    if (sending.in != sending.out && (USART2_SR & TXE)) USART2_DR = sending.bytes[sending.out++ % RING];
}

uint64_t hardware_now_ns(void) {
    static uint32_t before = SYSTICK_MAX;
    static uint64_t counts;
    const uint32_t value = SYSTICK(8);
    counts += (before - value) & SYSTICK_MAX; /* called more often than the counter goes round */
    before = value;
    return counts / CLOCK_HZ * 1000000000u + counts % CLOCK_HZ * 1000000000u / CLOCK_HZ;
}

int32_t hardware_read_encoder(int output) {
    (void)output;
    return (int32_t)TIM2(CNT);
}

void hardware_write_motor(int input, double volts) {
    const bool is_negative = volts < 0.0;
    double share = (is_negative ? -volts : volts) / SUPPLY_VOLTS;
    if (!(share >= 0.0)) share = 0.0; /* not a number */
    if (share > 1.0) share = 1.0;
    GPIO(1, BSRR) = is_negative ? 1u << input : 1u << (input + 16);
    TIM3(CCR1 + 4 * input) = (uint32_t)(share * PWM_STEPS);
}

static void set_up(void) {
    RCC_AHB1ENR |= 3u;                   /* ports A and B */
    RCC_APB1ENR |= 1u | 2u | 1u << 17;   /* timers 2 and 3, USART2 */
    (void)RCC_APB1ENR;
    GPIO(0, AFRL) = 0x22007711u;         /* PA0-1 timer 2, PA2-3 USART2, PA6-7 timer 3 */
    GPIO(0, PUPDR) = (GPIO(0, PUPDR) & ~0xFu) | 5u;
    GPIO(0, MODER) = (GPIO(0, MODER) & ~0xF0FFu) | 0xA0AAu;
    GPIO(1, MODER) = (GPIO(1, MODER) & ~0xFu) | 5u;
    TIM2(CCMR1) = 0x3131u;               /* both inputs, filtered */
    TIM2(SMCR) = 3u;                     /* counts every edge */
    TIM2(ARR) = 0xFFFFFFFFu;
    TIM2(CR1) = 1u;
    TIM3(ARR) = PWM_STEPS - 1u;
    TIM3(CCMR1) = 0x6868u;
    TIM3(CCER) = 0x11u;
    TIM3(EGR) = 1u;
    TIM3(CR1) = 0x81u;
    USART2_BRR = (CLOCK_HZ + LINE_BAUD / 2u) / LINE_BAUD;
    USART2_CR1 = 0x200Cu | RXNEIE;
    NVIC_ISER1 = 1u << (38 - 32);
    SYSTICK(4) = SYSTICK_MAX;
    SYSTICK(8) = 0;
    SYSTICK(0) = 5;
}

/* Differs from chip to chip and from start to start: the chip's number, and how long its first bytes took. */
static uint32_t incarnation(void) {
    const uint32_t chip = REGISTER(CHIP_NUMBER) ^ REGISTER(CHIP_NUMBER + 4) ^ REGISTER(CHIP_NUMBER + 8);
    return (chip + (uint32_t)hardware_now_ns() * 2654435761u) ^ SYSTICK(8) << 8;
}

int main(void) {
    static node own;
    set_up();
    for (;;) {
        node_begin(&own, incarnation());
        while (own.phase != NODE_ENDED || (own.session != 0 && own.guard.state != GUARD_LATCHED)) {
            node_poll(&own);
            send();
        }
        const uint64_t ended_ns = hardware_now_ns();
        while (hardware_now_ns() - ended_ns < 1000000000u) send();
        if (own.ending == ENDING_SAFETY_STOP) return 0; /* until the reset button */
    }
}
