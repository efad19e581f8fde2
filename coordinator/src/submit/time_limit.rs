//! A time limit as Slurm's users write it: minutes, minutes:seconds, hours:minutes:seconds, days-hours,
//! days-hours:minutes or days-hours:minutes:seconds (manual page of sbatch, --time).

/// Shortest limit, s: Slurm counts in minutes and may signal a minute early, so that a shorter job would be told to
/// stop as it starts.
const SHORTEST_S: u64 = 120;
/// Longest limit, s: a year.
const LONGEST_S: u64 = 365 * 86_400;

/// The limit in seconds, rounded up to whole minutes as Slurm does.
///
/// # Errors
/// It is none of the forms, or outside 2 minutes to a year.
pub fn seconds(text: &str) -> Result<u64, String> {
    let total = parse(text).ok_or_else(|| {
        "it must be minutes, hours:minutes:seconds or days-hours:minutes:seconds, for example 90, 12:00:00 or 2-00:00:00"
            .to_owned()
    })?;
    let total = total.div_ceil(60) * 60;
    if (SHORTEST_S..=LONGEST_S).contains(&total) {
        Ok(total)
    } else {
        Err(format!("it must be from {} minutes to 365 days", SHORTEST_S / 60))
    }
}

fn parse(text: &str) -> Option<u64> {
    let (days, rest) = match text.split_once('-') {
        Some((days, rest)) => (Some(number(days)?), rest),
        None => (None, text),
    };
    let parts = rest.split(':').map(number).collect::<Option<Vec<u64>>>()?;
    let (hours, minutes, seconds) = match (days, parts.as_slice()) {
        (None, [minutes]) => (0, *minutes, 0),
        (None, [minutes, seconds]) => (0, *minutes, *seconds),
        (Some(_), [hours]) => (*hours, 0, 0),
        (Some(_), [hours, minutes]) => (*hours, *minutes, 0),
        (_, [hours, minutes, seconds]) => (*hours, *minutes, *seconds),
        _ => return None,
    };
    Some(days.unwrap_or(0) * 86_400 + hours * 3600 + minutes * 60 + seconds)
}

/// Short enough that no sum of such numbers overflows.
fn number(text: &str) -> Option<u64> {
    if text.is_empty() || text.len() > 7 || !text.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    text.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_of_the_manual_is_read() {
        // The forms in the order of sbatch's manual page.
        let forms = [
            ("90", 5400),
            ("2:30", 180),
            ("1:02:03", 3780),
            ("2-3", 183_600),
            ("2-3:4", 183_840),
            ("2-03:04:05", 183_900),
        ];
        for (text, seconds) in forms {
            assert_eq!(super::seconds(text), Ok(seconds), "{text}");
        }
    }

    #[test]
    fn what_is_no_limit_is_refused() {
        for text in ["", "-", "1-", "soon", "1:2:3:4", "-5", "1 h", "UNLIMITED", "99999999", "$(id)"] {
            assert!(seconds(text).unwrap_err().contains("it must be minutes"), "{text}");
        }
        for text in ["1", "0:59", "366-0", "9999999"] {
            assert!(seconds(text).unwrap_err().contains("from 2 minutes"), "{text}");
        }
    }
}
