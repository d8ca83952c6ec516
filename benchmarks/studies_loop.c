/* The flight of the preset paper-10baud as a plain C loop: what a study is measured against.

   The same arithmetic as channel/numerics.py, channel/models/pitch.py, channel/coders/zoom.py,
   plant_sim/pitch.py and receiver/controllers/pid.py, in the same order, so that the bits agree when the
   compiler does not fuse multiplications with additions (-ffp-contract=off). */
#include <math.h>
#include <stdint.h>

static double sin_reduced(double r, double tail) {
    double z = r * r;
    double series = -0.1666666666666663 + z * (0.008333333333322108 + z * (-0.00019841269829580174
        + z * (2.755731361802039e-06 + z * (-2.5050747218679084e-08 + z * 1.5896197663986506e-10))));
    return r + (r * z * series + tail);
}

static double cos_reduced(double r, double tail) {
    double z = r * r;
    double series = 0.0416666666666666 + z * (-0.0013888888888874125 + z * (2.48015872894822e-05
        + z * (-2.7557314352336624e-07 + z * (2.0875723273695147e-09 + z * -1.135964782546109e-11))));
    return 1.0 - (0.5 * z - (z * z * series - r * tail));
}

static double own_sin(double x) {
    if (-0.7853981633974483 <= x && x <= 0.7853981633974483) return sin_reduced(x, 0.0);
    int64_t quarters = x < 0.0 ? -(int64_t)floor(0.5 - x * 0.6366197723675814)
                               : (int64_t)floor(0.5 + x * 0.6366197723675814);
    double high = x - quarters * 1.5707963267923333;
    double middle = quarters * 2.5633441515839558e-12;
    double r = high - middle;
    double tail = ((high - r) - middle) - quarters * 1.0562999066987428e-23;
    switch (quarters & 3) {
        case 0: return sin_reduced(r, tail);
        case 1: return cos_reduced(r, tail);
        case 2: return -sin_reduced(r, tail);
        default: return -cos_reduced(r, tail);
    }
}

/* c: damping, stiffness, gain, equilibrium, h, decay over half a tick, over a tick */
static void observe(double *s, double front_volts, double rear_volts, double e1, double e2,
                    const double *c) {
    double theta = s[0], omega = s[1], h = c[4];
    double volts = front_volts - rear_volts, lagging = s[2] - s[3] - volts;
    double start = e2 + c[2] * (volts + lagging);
    double mid = e2 + c[2] * (volts + lagging * c[5]);
    double end = e2 + c[2] * (volts + lagging * c[6]);
    double half = 0.5 * h, angle = theta - c[3];
    double angle_1 = omega + e1, rate_1 = start - c[0] * omega - c[1] * own_sin(angle);
    double omega_2 = omega + half * rate_1, angle_2 = omega_2 + e1;
    double rate_2 = mid - c[0] * omega_2 - c[1] * own_sin(angle + half * angle_1);
    double omega_3 = omega + half * rate_2, angle_3 = omega_3 + e1;
    double rate_3 = mid - c[0] * omega_3 - c[1] * own_sin(angle + half * angle_2);
    double omega_4 = omega + h * rate_3, angle_4 = omega_4 + e1;
    double rate_4 = end - c[0] * omega_4 - c[1] * own_sin(angle + h * angle_3);
    double sixth = h / 6.0;
    s[0] = theta + sixth * (angle_1 + 2.0 * (angle_2 + angle_3) + angle_4);
    s[1] = omega + sixth * (rate_1 + 2.0 * (rate_2 + rate_3) + rate_4);
    s[2] = front_volts + (s[2] - front_volts) * c[6];
    s[3] = rear_volts + (s[3] - rear_volts) * c[6];
}

/* c: damping, stiffness, gain, equilibrium, largest voltage, h, left after half a step, after a step */
static void plant(double *s, double v_f, double v_r, double torque, const double *c) {
    double theta = s[0], omega = s[1], h = c[5];
    v_f = fmin(fmax(v_f, -c[4]), c[4]);
    v_r = fmin(fmax(v_r, -c[4]), c[4]);
    double mu = v_f - v_r, excess = s[2] - s[3] - mu;
    double start = c[2] * (mu + excess) + torque, mid = c[2] * (mu + excess * c[6]) + torque;
    double end = c[2] * (mu + excess * c[7]) + torque, half = 0.5 * h;
    double k1 = start - c[0] * omega - c[1] * own_sin(theta - c[3]);
    double w2 = omega + half * k1;
    double k2 = mid - c[0] * w2 - c[1] * own_sin(theta + half * omega - c[3]);
    double w3 = omega + half * k2;
    double k3 = mid - c[0] * w3 - c[1] * own_sin(theta + half * w2 - c[3]);
    double w4 = omega + h * k3;
    double k4 = end - c[0] * w4 - c[1] * own_sin(theta + h * w3 - c[3]);
    s[0] = theta + h / 6.0 * (omega + 2.0 * (w2 + w3) + w4);
    s[1] = omega + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
    s[2] = v_f + (s[2] - v_f) * c[7];
    s[3] = v_r + (s[3] - v_r) * c[7];
}

static double clamp(double v, double largest) { return v > largest ? largest : v < -largest ? -largest : v; }

/* pid: kP, kI per tick, kD, largest voltage, normal force; zoom: decay, floor, l1, l2, M_0.
   out: sum of squares and largest coded error, sum of squares of tracking, all from `window` on. */
void flight(int64_t samples, int64_t per_sample, int64_t window, int64_t counts_per_turn,
            const double *model_c, const double *plant_c, const double *pid, const double *zoom,
            const double *reference, const double *torque, double *out) {
    const double tau = 6.283185307179586;
    double body[4] = {0, 0, 0, 0}, state[4] = {0, 0, 0, 0};
    double range = zoom[4], last = 0.0, integral = 0.0;
    double squares = 0.0, largest = 0.0, tracking = 0.0;
    for (int64_t sample = 0; sample < samples; sample++) {
        double measured = (int64_t)floor(body[0] / tau * counts_per_turn + 0.5) * tau / counts_per_turn;
        double sign = measured >= state[0] ? 1.0 : -1.0;
        double e1 = zoom[2] * (range * sign), e2 = zoom[3] * (range * sign);
        double total = sign + last;
        last = sign;
        range = zoom[1] + (2.0 * total > 2.0 || 2.0 * total < -2.0 ? range / zoom[0] : zoom[0] * range);
        for (int64_t tick = sample * per_sample; tick < (sample + 1) * per_sample; tick++) {
            double error = reference[tick] - state[0];
            double volts = pid[0] * error + integral - pid[2] * state[1];
            if (!(fabs(volts) - fabs(pid[4]) >= 2.0 * pid[3] && error * volts > 0.0))
                integral = integral + pid[1] * error;
            double front = rint(1000.0 * clamp((pid[4] + volts) / 2.0, pid[3])) / 1000.0;
            double rear = rint(1000.0 * clamp((pid[4] - volts) / 2.0, pid[3])) / 1000.0;
            if (tick >= window) {
                double coded = body[0] - state[0], far = reference[tick] - body[0];
                squares += coded * coded;
                largest = fmax(largest, fabs(coded));
                tracking += far * far;
            }
            observe(state, front, rear, e1, e2, model_c);
            plant(body, front, rear, torque[tick], plant_c);
        }
    }
    out[0] = squares;
    out[1] = largest;
    out[2] = tracking;
}
