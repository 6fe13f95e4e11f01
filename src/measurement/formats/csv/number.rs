//! Numbers as they stand in tables.

/// Words for a value that was not measured, in lower case.
const MISSING: [&str; 13] =
    ["nan", "-nan", "+nan", "na", "n/a", "#n/a", "null", "none", "-", "--", ".", "1.#qnan", "-1.#ind"];

/// Whether a field says that nothing was measured: it is blank, or one of the usual words.
pub(super) fn is_missing(field: &str) -> bool {
    // Longer fields are no words; those of NaN with a payload are.
    if field.is_empty() {
        return true;
    }
    if field.len() > 24 || !field.is_ascii() {
        return false;
    }
    let lower = field.to_ascii_lowercase();
    MISSING.contains(&lower.as_str())
        || lower.trim_start_matches(['-', '+']).starts_with("nan(")
        || lower.trim_start_matches(['-', '+']).starts_with("1.#qnan")
        || lower.trim_start_matches(['-', '+']).starts_with("1.#ind")
}

/// A finite number; `None` for anything else. A comma may stand before the fraction, and the exponent may be Fortran's D.
pub(super) fn number(field: &str, decimal_comma: bool) -> Option<f64> {
    let finite = |value: &f64| value.is_finite();
    if let Ok(value) = field.parse::<f64>() {
        return Some(value).filter(finite);
    }
    // A typographic minus, as word processors write it.
    let plain = field.replace('\u{2212}', "-");
    let plain = if decimal_comma && plain.matches(',').count() == 1 && !plain.contains('.') {
        plain.replace(',', ".")
    } else {
        plain
    };
    let is_fortran = |c: char| c.is_ascii_digit() || "+-.dD".contains(c);
    let plain = if plain.chars().all(is_fortran) { plain.replace(['d', 'D'], "e") } else { plain };
    if plain == field || plain.len() > 400 {
        return None;
    }
    plain.parse().ok().filter(finite)
}

/// Whether a field is a number with a comma before its fraction.
pub(super) fn has_decimal_comma(field: &str) -> bool {
    field.contains(',') && number(field, false).is_none() && number(field, true).is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_as_people_write_them() {
        for (field, value) in [
            ("1", 1.0),
            ("-0,5", -0.5),
            ("1.5E-3", 1.5e-3),
            ("1.0D-03", 1e-3),
            ("\u{2212}0.1", -0.1),
            ("1,5e2", 150.0),
        ] {
            assert_eq!(number(field, true), Some(value), "{field}");
        }
        for field in ["", "x", "1 000.5", "1'000", "1.000,5", "1,000,5", "inf", "nan", "0x1p-3", "1e999"] {
            assert_eq!(number(field, true), None, "{field}");
        }
        assert_eq!(number("0,5", false), None);
        assert!(has_decimal_comma("0,5") && !has_decimal_comma("0.5") && !has_decimal_comma("1,000,5"));
    }

    #[test]
    fn words_for_what_was_not_measured() {
        for field in
            ["", "nan", "NaN", "-nan", "NA", "N/A", "#N/A", "null", "-", "--", ".", "1.#QNAN", "nan(0x1)"]
        {
            assert!(is_missing(field), "{field}");
        }
        for field in ["inf", "-inf", "0", "x", "1.#INF", "-999", "∞"] {
            assert!(!is_missing(field), "{field}");
        }
    }
}
