//! What to name in a message about a name that is not known.

/// `; did you mean "x"?` with the nearest of `names`, or nothing if none is near.
pub(super) fn did_you_mean<'a>(wrong: &str, names: impl Iterator<Item = &'a str>) -> String {
    let limit = (wrong.chars().count() / 3).clamp(1, 3);
    let nearest = names.map(|name| (distance(wrong, name), name)).min();
    match nearest {
        Some((d, name)) if d <= limit && name != wrong => format!("; did you mean \"{name}\"?"),
        _ => String::new(),
    }
}

/// The names with commas between them.
pub(super) fn list<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<&str> = names.collect();
    if names.is_empty() { "nothing".to_owned() } else { names.join(", ") }
}

/// Levenshtein's edit distance, over characters and without regard to case.
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.to_lowercase().chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.to_lowercase().chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_counts_edits() {
        for (a, b, d) in [("", "", 0), ("", "ab", 2), ("kitten", "sitting", 3), ("abc", "ABC", 0), ("ab", "ba", 2)] {
            assert_eq!(distance(a, b), d, "{a} {b}");
            assert_eq!(distance(b, a), d, "{b} {a}");
        }
    }

    #[test]
    fn only_near_names_are_suggested() {
        let names = ["fov", "to_world", "near_clip"];
        assert_eq!(did_you_mean("toworld", names.into_iter()), "; did you mean \"to_world\"?");
        assert_eq!(did_you_mean("FOV", names.into_iter()), "; did you mean \"fov\"?");
        assert_eq!(did_you_mean("fov", names.into_iter()), "");
        assert_eq!(did_you_mean("aperture", names.into_iter()), "");
    }
}
