//! A fitted model as a source file.

use super::Regression;
use std::fmt::Write;

/// Digits kept of a number.
const DIGITS: usize = 5;

/// The source of constants `MEANS`, `SCALES`, `CONSTANT` and `FACTORS`, headed by `about`.
#[must_use]
pub fn source<const N: usize>(model: &Regression<N>, about: &str) -> String {
    let mut text = String::new();
    for line in about.lines() {
        let _ = writeln!(text, "//! {line}");
    }
    let _ = writeln!(
        text,
        "\n#[rustfmt::skip]\npub(crate) const MEANS: [f64; {N}] = [{}];",
        list(&model.means)
    );
    let _ = writeln!(
        text,
        "#[rustfmt::skip]\npub(crate) const SCALES: [f64; {N}] = [{}];",
        list(&model.scales)
    );
    let _ = writeln!(text, "pub(crate) const CONSTANT: f64 = {};", number(model.constant));
    let count = model.factors.len();
    let _ = writeln!(
        text,
        "#[rustfmt::skip]\n#[allow(clippy::approx_constant, reason = \"any of so many numbers may come near one\")]\npub(crate) const FACTORS: [f64; {count}] = [{}];",
        list(&model.factors)
    );
    text
}

fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.DIGITS$}").parse().unwrap_or(value);
    format!("{rounded:?}")
}

fn list(values: &[f64]) -> String {
    let lines = values.chunks(12).map(|chunk| {
        let numbers: Vec<String> = chunk.iter().map(|value| number(*value)).collect();
        format!("\n    {},", numbers.join(", "))
    });
    lines.collect::<String>() + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_and_remain_numbers() {
        let model = Regression {
            means: [1.0],
            scales: [0.333_333_3],
            constant: -2.0,
            factors: vec![1e-9, 4.0],
            loss: 0.5,
        };
        let text = source(&model, "About.");
        assert!(text.starts_with("//! About.\n"));
        assert!(
            text.contains("0.33333") && text.contains("-2.0") && text.contains("[f64; 2]"),
            "{text}"
        );
    }
}
