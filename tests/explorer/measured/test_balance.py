"""A balance's curve against closed forms: a steady flow of known rate, read by a balance of first order."""

import numpy as np
import pytest

from explorer.errors import CommandError
from explorer.measured.balance import read_balance

RATE, LASTS, BEGINS, LAG = 0.010, 3.0, 0.7, 0.15
MASS = RATE * LASTS


def steady(time, lag=LAG):
    """Mass [kg] that a balance with the time constant ``lag`` reads: τ ẏ + y = m, m growing at RATE for LASTS."""
    since = np.clip(np.asarray(time) - BEGINS, 0.0, None)
    if lag == 0.0:
        return RATE * np.minimum(since, LASTS)
    growing = RATE * (since - lag * (1.0 - np.exp(-since / lag)))
    end = RATE * lag * (1.0 - np.exp(-LASTS / lag))
    return np.where(since < LASTS, growing, MASS - end * np.exp(-(since - LASTS) / lag))


def write(path, time, mass, head="time_s,mass_g"):
    path.write_text(
        head + "\n" + "".join(f"{t!r},{1e3 * m!r}\n" for t, m in zip(time.tolist(), mass.tolist(), strict=True))
    )
    return path


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("interval", [0.02, 0.05, 0.1])
def test_rate_mass_and_lag_of_a_steady_flow(interval, sign, tmp_path):
    """Under the pile or under the vessel, and from any zero."""
    time = np.arange(0.0, 8.0, interval)
    curve = read_balance(write(tmp_path / "b.csv", time, 0.25 + sign * steady(time)))
    assert curve.total == pytest.approx(MASS, rel=1e-6)
    assert curve.rate == pytest.approx(RATE, rel=1e-3)
    assert curve.interval == pytest.approx(interval)
    # Between two readings the curve is taken as straight, which lies below it by q interval²/(8 τ e) at most.
    assert LAG * 0.99 <= curve.lag <= LAG + interval**2 / (8.0 * LAG) + 1e-3
    for share in (0.5, 0.9):
        assert curve.share_time(share, MASS) == pytest.approx(BEGINS + share * LASTS + LAG, abs=1e-3)


def test_a_balance_that_follows_at_once_has_no_lag(tmp_path):
    time = np.arange(0.0, 8.0, 0.05)
    curve = read_balance(write(tmp_path / "b.csv", time, steady(time, 0.0)))
    assert curve.lag < 1e-3
    assert curve.share_time(0.1, MASS) == pytest.approx(BEGINS + 0.1 * LASTS, abs=1e-6)


def test_shares_are_of_what_was_poured_where_some_stayed_behind(tmp_path):
    time = np.arange(0.0, 8.0, 0.05)
    curve = read_balance(write(tmp_path / "b.csv", time, steady(time, 0.0)))
    assert curve.share_time(0.5, 1.01 * MASS) == pytest.approx(BEGINS + 0.5 * LASTS, abs=1e-6)
    assert curve.share_time(0.5, 1.2 * MASS) == pytest.approx(BEGINS + 0.6 * LASTS, abs=1e-6)
    assert np.isnan(curve.share_time(0.9, 1.2 * MASS))
    assert "83.3% of what is poured" in curve.line(1.2 * MASS, None)


def test_a_pan_that_was_touched_is_told_by_its_line(tmp_path):
    """A reading far above the others, before the flow, would have been the time of a tenth."""
    time = np.arange(0.0, 8.0, 0.05)
    touched = steady(time)
    touched[8] += 0.3 * MASS
    with pytest.raises(
        CommandError, match=r"b\.csv:10: mass: 10% of the change has passed at 0\.4 s, and again at 1\.\d+ s"
    ):
        read_balance(write(tmp_path / "b.csv", time, touched))
    pressed = steady(time)
    pressed[:5] += 0.2 * MASS  # while the zero is taken
    with pytest.raises(CommandError, match="on the other side of its first readings"):
        read_balance(write(tmp_path / "b.csv", time, pressed))
    noisy = steady(time) + 0.005 * MASS * np.random.default_rng(1).standard_normal(time.size)
    assert read_balance(write(tmp_path / "b.csv", time, noisy)).rate == pytest.approx(RATE, rel=0.02)


def test_decimal_commas_and_other_units(tmp_path):
    time = np.arange(0.0, 8.0, 0.05)
    rows = "".join(f"{1e3 * t:.1f};{m:.7f};x\n".replace(".", ",") for t, m in zip(time, steady(time), strict=True))
    (tmp_path / "b.csv").write_text("time_ms;mass_kg;note\n" + rows)
    assert read_balance(tmp_path / "b.csv").rate == pytest.approx(RATE, rel=1e-3)


def test_a_row_of_decimal_commas_between_commas_is_refused(tmp_path):
    (tmp_path / "b.csv").write_text("time_s,mass_g\n" + "".join(f"{k},0,{k},5\n" for k in range(20)))
    with pytest.raises(CommandError, match=r"b\.csv:2: 4 cells; allowed: 2, one per column"):
        read_balance(tmp_path / "b.csv")


def test_a_row_may_leave_out_its_remark(tmp_path):
    time = np.arange(0.0, 8.0, 0.05)
    rows = "".join(f"{t:.2f},{m:.7f}\n" for t, m in zip(time, steady(time), strict=True))
    (tmp_path / "b.csv").write_text("time_s,mass_kg,remark\n" + rows)
    assert read_balance(tmp_path / "b.csv").rate == pytest.approx(RATE, rel=1e-3)


TIME = np.arange(0.0, 8.0, 0.05)


@pytest.mark.parametrize(
    ("time", "mass", "head", "words"),
    [
        (TIME[:5], TIME[:5], "time_s,mass_g", "5 readings; allowed: 10 or more"),
        (TIME, steady(TIME), "t,m", "columns t,m; allowed: one of time_s, time_ms, time_min"),
        (TIME[::-1], steady(TIME), "time_s,mass_g", r"b.csv:3: time: does not increase"),
        (TIME[:60], steady(TIME)[:60], "time_s,mass_g", "not constant at the end"),
        (TIME, 0.0 * TIME, "time_s,mass_g", "not constant at the end"),
        (TIME, np.where(TIME < 3.0, 0.0, 0.03), "time_s,mass_g", "1 readings between 20% and 80%"),
        (TIME, np.where(TIME[7] == TIME, np.nan, steady(TIME)), "time_s,mass_g", "b.csv:9: mass_g: 'nan'"),
    ],
)
def test_what_is_no_curve_of_a_pour_is_one_line(time, mass, head, words, tmp_path):
    with pytest.raises(CommandError, match=words) as raised:
        read_balance(write(tmp_path / "b.csv", time, mass, head))
    assert "\n" not in str(raised.value)
