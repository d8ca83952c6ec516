/* The node as a program: a serial port or a socket, and a simulated rig.
 *
 *     node PORT [SECONDS]      PORT: /dev/ttyUSB0, a pseudo-terminal, or listen:TCP-PORT on 127.0.0.1
 *
 * Every second, and at the end, a line of counts goes to standard output. Exit code 0: the flight went to its
 * end; 3: refused; 5: ended otherwise; 2: the port cannot be opened. A port that goes away is opened again.
 */
#define _DEFAULT_SOURCE

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <termios.h>
#include <time.h>
#include <unistd.h>

#include "../hardware.h"
#include "../simulated/rig.h"

static int port = -1, server = -1;
static uint8_t received[4096];
static int received_at, received_end;

uint64_t hardware_now_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

static void lose_port(void) {
    close(port);
    port = -1;
}

int hardware_read_byte(void) {
    if (received_at == received_end) {
        if (port < 0) return -1;
        const ssize_t count = read(port, received, sizeof received);
        if (count == 0 || (count < 0 && errno != EAGAIN && errno != EINTR)) lose_port();
        if (count <= 0) return -1;
        received_at = 0;
        received_end = (int)count;
    }
    return received[received_at++];
}

void hardware_write_byte(uint8_t byte) {
    if (port >= 0 && write(port, &byte, 1) != 1) return; /* dropped, as on any line */
}

static int listen_at(const char *number) {
    struct sockaddr_in here = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    const int on = 1, listening = socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK, 0);
    here.sin_port = htons((uint16_t)atoi(number));
    setsockopt(listening, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (bind(listening, (struct sockaddr *)&here, sizeof here) || listen(listening, 1)) return -1;
    return listening;
}

static int open_port(const char *path) {
    struct termios line;
    const int opened = open(path, O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (opened >= 0 && tcgetattr(opened, &line) == 0) {
        cfmakeraw(&line);
        line.c_cc[VMIN] = 1; /* nothing to read is no end of the file */
        cfsetspeed(&line, B115200);
        tcsetattr(opened, TCSANOW, &line);
    }
    return opened;
}

static void accept_peer(void) {
    const int on = 1, peer = accept(server, 0, 0);
    if (peer < 0) return;
    if (port >= 0) lose_port();
    port = peer;
    fcntl(port, F_SETFL, O_NONBLOCK);
    setsockopt(port, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

static void put(char one) { putchar(one); }

static void report(const node *own) {
    rig_report(own, put);
    fflush(stdout);
}

static void wait_for_bytes(const char *path) {
    struct pollfd waiting[2] = {{server, POLLIN, 0}, {port, POLLIN, 0}};
    poll(waiting, 2, 1);
    if (server >= 0 && waiting[0].revents & POLLIN) accept_peer();
    if (server < 0 && port < 0) port = open_port(path);
}

int main(int count, char **arguments) {
    static node own;
    if (count < 2) {
        fprintf(stderr, "usage: %s PORT [SECONDS]\n", arguments[0]);
        return 2;
    }
    if (strncmp(arguments[1], "listen:", 7) == 0) server = listen_at(arguments[1] + 7);
    else port = open_port(arguments[1]);
    if (server < 0 && port < 0) {
        fprintf(stderr, "%s cannot be opened: %s\n", arguments[1], strerror(errno));
        return 2;
    }
    signal(SIGPIPE, SIG_IGN);
    rig_begin();
    const uint64_t began_ns = hardware_now_ns();
    const uint64_t end_ns = count > 2 ? began_ns + (uint64_t)(atof(arguments[2]) * 1e9) : UINT64_MAX;
    node_begin(&own, (uint32_t)(began_ns ^ began_ns >> 32) * 2654435761u ^ (uint32_t)getpid());
    uint64_t reported_ns = began_ns;
    while (hardware_now_ns() < end_ns) {
        wait_for_bytes(arguments[1]);
        node_poll(&own);
        if (hardware_now_ns() - reported_ns >= 1000000000u) {
            reported_ns += 1000000000u;
            report(&own);
        }
        if (own.phase == NODE_ENDED && (own.session == 0 || own.guard.state == GUARD_LATCHED)) break;
    }
    if (own.phase == NODE_FLYING || own.phase == NODE_REJOINING) session_bye(&own, 1);
    report(&own);
    usleep(300000); /* the other end reads the farewell before a socket closes */
    return own.is_refused ? 3 : own.ending == 1 ? 0 : 5;
}
