/* The registers of an LM3S6965, a Cortex-M3 that QEMU emulates (-machine lm3s6965evb). */
#ifndef TENBAUD_BOARD_H
#define TENBAUD_BOARD_H

#include <stdint.h>

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define UART(number) (0x4000C000u + 0x1000u * (number))
#define UART_DATA(number) REGISTER(UART(number))
#define UART_FLAGS(number) REGISTER(UART(number) + 0x18u)
#define UART_LINE(number) REGISTER(UART(number) + 0x2Cu)
#define UART_CONTROL(number) REGISTER(UART(number) + 0x30u)
#define FLAG_NOTHING_RECEIVED (1u << 4)
#define FLAG_NO_ROOM (1u << 5)

#define SYSTICK_CONTROL REGISTER(0xE000E010u)
#define SYSTICK_LOAD REGISTER(0xE000E014u)
#define SYSTICK_VALUE REGISTER(0xE000E018u)
#define SYSTICK_MAX 0xFFFFFFu
#define STACK_UNUSED 0xA5A5A5A5u
#define NS_PER_COUNT 80u /* 12.5 MHz, as the chip's clock is after a reset */

#endif
