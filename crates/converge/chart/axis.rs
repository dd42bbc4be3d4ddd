//! A logarithmic axis: where values lie on it, and which of them are named.

/// From the least to the greatest value shown, and where these lie, points.
#[derive(Clone, Copy, Debug)]
pub struct Axis {
    least: f64,
    greatest: f64,
    from: f64,
    to: f64,
}

/// Share of the axis that stays free on either side.
const MARGIN: f64 = 0.06;

/// An axis shows at least this factor, so that what is all alike is not torn apart.
const LEAST_RANGE: f64 = 4.0;

/// A value with a line across the diagram, and its name if it has one.
#[derive(Clone, Debug, PartialEq)]
pub struct Tick {
    /// Where.
    pub value: f64,
    /// What is written there.
    pub name: Option<String>,
}

impl Axis {
    /// An axis on which all of `values` lie; `None`: none is positive.
    pub fn about(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Option<Self> {
        let (least, greatest) = values
            .filter(|value| *value > 0.0 && value.is_finite())
            .fold((f64::INFINITY, 0.0_f64), |(low, high), value| {
                (low.min(value), high.max(value))
            });
        if greatest <= 0.0 {
            return None;
        }
        let range = (greatest / least).max(LEAST_RANGE);
        let middle = (least * greatest).sqrt();
        let reach = range.powf(0.5 + MARGIN);
        Some(Self {
            least: middle / reach,
            greatest: middle * reach,
            from,
            to,
        })
    }

    /// The same, with more room below (in shares of its length).
    pub fn with_room_below(mut self, share: f64) -> Self {
        self.least /= (self.greatest / self.least).powf(share);
        self
    }

    /// The same, with more room above.
    pub fn with_room_above(mut self, share: f64) -> Self {
        self.greatest *= (self.greatest / self.least).powf(share);
        self
    }

    /// Points.
    pub fn place(&self, value: f64) -> f64 {
        let share = (value / self.least).ln() / (self.greatest / self.least).ln();
        self.from + share * (self.to - self.from)
    }

    /// Where the axis ends, the lower end.
    pub fn least(&self) -> f64 {
        self.least
    }

    /// Every digit of every power of ten; named are as many of them as there is room for.
    pub fn ticks(&self) -> Vec<Tick> {
        let decades = (self.greatest / self.least).log10();
        let named: &[u32] = match decades {
            ..1.3 => &[1, 2, 3, 5, 7],
            1.3..3.2 => &[1, 2, 5],
            _ => &[1],
        };
        let powers = self.least.log10().floor() as i32..=self.greatest.log10().ceil() as i32;
        powers
            .flat_map(|power| (1..=9).map(move |digit| (digit, power)))
            .map(|(digit, power)| Tick {
                value: f64::from(digit) * 10.0_f64.powi(power),
                name: named.contains(&digit).then(|| name(digit, power)),
            })
            .filter(|tick| (self.least..=self.greatest).contains(&tick.value))
            .collect()
    }
}

/// `digit * 10^power`: written out from 0.001 to 1000, else as a power.
fn name(digit: u32, power: i32) -> String {
    match power {
        -3..=-1 => format!(
            "{:.*}",
            power.unsigned_abs() as usize,
            f64::from(digit) * 10.0_f64.powi(power)
        ),
        0..=3 => format!("{}", digit * 10_u32.pow(power.unsigned_abs())),
        _ if digit == 1 => format!("10{}", raised(power)),
        _ => format!("{digit}\u{b7}10{}", raised(power)),
    }
}

fn raised(power: i32) -> String {
    power
        .to_string()
        .chars()
        .map(|c| match c {
            '-' => '\u{207b}',
            '1' => '\u{b9}',
            '2' => '\u{b2}',
            '3' => '\u{b3}',
            digit => char::from_u32(0x2070 + digit.to_digit(10).unwrap_or(0)).unwrap_or(digit),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_is_a_distance() {
        let axis = Axis::about([0.1, 10.0].into_iter(), 0.0, 100.0).unwrap();
        let [a, b, c] = [0.1, 1.0, 10.0].map(|value| axis.place(value));
        assert!(a > 0.0 && c < 100.0);
        assert!((b - 50.0).abs() < 1e-9, "{b}");
        assert!((b - a - (c - b)).abs() < 1e-9);
    }

    #[test]
    fn without_positive_values_there_is_no_axis() {
        assert!(Axis::about([0.0, -1.0, f64::NAN].into_iter(), 0.0, 1.0).is_none());
        let single = Axis::about([2.0].into_iter(), 0.0, 1.0).unwrap();
        assert!((single.place(2.0) - 0.5).abs() < 1e-9);
    }

    #[test]
    fn ticks_are_named_as_one_writes_them() {
        for (digit, power, text) in [
            (1, 0, "1"),
            (5, -1, "0.5"),
            (2, -3, "0.002"),
            (1, -4, "10\u{207b}\u{2074}"),
            (2, 2, "200"),
            (5, -5, "5\u{b7}10\u{207b}\u{2075}"),
            (1, 12, "10\u{b9}\u{b2}"),
        ] {
            assert_eq!(name(digit, power), text);
        }
        let axis = Axis::about([0.01, 1.0].into_iter(), 0.0, 1.0).unwrap();
        let named: Vec<String> = axis
            .ticks()
            .into_iter()
            .filter_map(|tick| tick.name)
            .collect();
        assert_eq!(named, ["0.01", "0.02", "0.05", "0.1", "0.2", "0.5", "1"]);
    }
}
