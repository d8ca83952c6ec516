"""Ambiguities and misprints of the paper's text, and our choices."""

from __future__ import annotations

MISPRINTS: tuple[tuple[str, str, str], ...] = (
    (
        "(12)",
        "the same letter for the filter's output and for the voltage",
        "`T_m vbar' + vbar = v` and `mu = vbar_f - vbar_r`: only then is `mu` the output of the "
        "low-pass filters, as the sentence below it says",
    ),
    (
        "(13)",
        "`theta_1' = xi_2`, and `xi'` where `xi` is meant",
        "`theta_1' = theta_2`; the filtered acceleration is `theta_2'` itself",
    ),
    ("(15)", "`psi_1' = eta_2`", "`psi_1' = psi_2`: the filter of (14), for `mu`"),
    (
        "after (15)",
        "the regressor is printed with the unfiltered `theta, s, mu`",
        "the filtered rate, `s_f` and `mu_f`: (6) holds between signals that passed equal filters",
    ),
    (
        "(10)",
        "as printed, `Gamma` grows without bound when the excitation fades",
        "`alpha` is scaled by `1 - norm(Gamma) / bound`; with excitation nothing changes",
    ),
    (
        "(19), signals",
        "`lambda_k` is the mean of the *scaled* signals",
        "the mean of the **signs**: with the scaled ones `M` could never grow again once below 0.5, "
        "against the surrounding text",
    ),
    (
        "(19), window",
        "two signs",
        "two in the paper presets; a setting (`coder.window_signs`), because with an exact model two "
        "signs enter the pattern `++--` and the range stays up (see the table)",
    ),
    (
        "(22)",
        "the held signal is `e_k` without its bar",
        "`M_k sigma_k`: the receiver knows no other value",
    ),
    ("(23)", "the gain is `k_m^y`", "`k_v` of (11)"),
    (
        "(24)",
        "`k_P = 0.1` and the others come without the unit of the angle",
        "V per **degree**: read as V/rad, the loop does not reach its reference (see the table)",
    ),
    (
        "(24), saturation",
        "the paper does not say what the integral does while the motors saturate",
        "the integral is held while both motors are at their limit and the error would drive them "
        "further",
    ),
    (
        "Sec. IV",
        "'5 % of the pitch amplitude' may mean of the largest pitch or of the reference",
        "both are given; the loop overshoots, so the first fraction is the smaller one",
    ),
    (
        "Sec. IV",
        "the paper does not say when errors begin to count",
        "after the first period, 25 s",
    ),
    (
        "Sec. IV",
        "`M_k decreases` near rapid changes of the pitch",
        "it *increases* there, as (19) and the text before it say",
    ),
    (
        "Fig. 3",
        "frequency, bias and magnitude of the two exciting signals are not printed",
        "two square waves of our own, named above their panels",
    ),
    (
        "channel",
        "the paper assumes that a bit arrives at the instant of its sample",
        'the same here, with `delivery = "start"`; a wire of 10 bit/s needs 0.1 s for a bit, which '
        '`delivery = "end"` is for',
    ),
)
"""Equation or place, what is printed, what was chosen and why."""
