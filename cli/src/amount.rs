//! Amounts as people read them: numbers of samples, lengths of time, dates.

use std::time::{SystemTime, UNIX_EPOCH};

/// A number with the units that `--samples` takes: 800k, 1.25M.
pub fn count(number: u64) -> String {
    let (scaled, unit) = match number {
        0..1_000 => return number.to_string(),
        1_000..1_000_000 => (number as f64 / 1e3, "k"),
        _ => (number as f64 / 1e6, "M"),
    };
    // Rounded down: what isn't whole is never shown as whole.
    let digits = if scaled < 10.0 { 100.0 } else { 10.0 };
    format!("{}{unit}", (scaled * digits).floor() / digits)
}

/// A number with at most four digits that count: 0.05644, 29.97, 1.
pub fn digits(number: f64) -> String {
    let size = number.abs().log10().floor();
    if !(-6.0..7.0).contains(&size) && number != 0.0 {
        return format!("{number:.3e}");
    }
    let after = (3.0 - size.max(-6.0)).max(0.0) as usize;
    let text = format!("{number:.after$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// A length of time, in the largest unit that it fills: 45 s, 12 min, 3 h, 2 days.
pub fn duration(seconds: f64) -> String {
    let (second, minute, hour, day) = (1.0, 60.0, 3600.0, 86_400.0);
    let (unit, name) = match seconds {
        s if s < 1.5 * minute => (second, "s"),
        s if s < 1.5 * hour => (minute, "min"),
        s if s < 2.0 * day => (hour, "h"),
        _ => (day, "days"),
    };
    format!("{:.0} {name}", (seconds / unit).max(0.0))
}

/// A date and time of day as in RFC 3339, in UTC: 2026-12-01T06:37:08Z.
pub fn date(time: SystemTime) -> String {
    let since = time.duration_since(UNIX_EPOCH).unwrap_or_default();
    let (days, second) = (since.as_secs() / 86_400, since.as_secs() % 86_400);
    let (year, month, day) = civil(days);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    format!("{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{second:02}Z")
}

/// Year, month and day of the Gregorian calendar, so many days after 1 January 1970. By Howard Hinnant's
/// "chrono-compatible low-level date algorithms": years begin in March, so that the leap day is their last.
fn civil(days: u64) -> (u64, u64, u64) {
    let day = days + 719_468;
    let (era, day) = (day / 146_097, day % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day + 2) / 153;
    let first = (153 * month + 2) / 5;
    let january = month >= 10;
    let month = if january { month - 9 } else { month + 3 };
    (
        era * 400 + year + u64::from(january),
        month,
        day - first + 1,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn counts_are_short_and_never_too_many() {
        let words = [0, 512, 4096, 800_000, 1_250_000, 4_000_000, 3_999_999].map(count);
        assert_eq!(words, ["0", "512", "4.09k", "800k", "1.25M", "4M", "3.99M"]);
        assert_eq!(count(128_000_000), "128M");
    }

    #[test]
    fn numbers_have_four_digits_at_most() {
        for (number, text) in [
            (0.056_444_448_9, "0.05644"),
            (29.97, "29.97"),
            (120.0, "120"),
            (0.01, "0.01"),
            (1.0, "1"),
            (-1234.567, "-1235"),
            (9999.99, "10000"),
            (0.0, "0"),
            (1.5e300, "1.500e300"),
            (1e-9, "1.000e-9"),
            (f64::NAN, "NaN"),
            (f64::INFINITY, "inf"),
        ] {
            assert_eq!(digits(number), text);
        }
    }

    #[test]
    fn durations_have_one_unit() {
        let words = [0.0, 59.4, 300.0, 7200.0, 400_000.0].map(duration);
        assert_eq!(words, ["0 s", "59 s", "5 min", "2 h", "5 days"]);
        assert_eq!(duration(-1.0), "0 s");
    }

    #[test]
    fn dates_follow_the_calendar() {
        for (seconds, text) in [
            (0, "1970-01-01T00:00:00Z"),
            // Given by `date -u -d @SECONDS +%FT%TZ`.
            (951_782_400, "2000-02-29T00:00:00Z"),
            (1_709_251_199, "2024-02-29T23:59:59Z"),
            (1_796_107_028, "2026-12-01T06:37:08Z"),
            (4_107_542_400, "2100-03-01T00:00:00Z"),
        ] {
            assert_eq!(date(UNIX_EPOCH + Duration::from_secs(seconds)), text);
        }
    }
}
