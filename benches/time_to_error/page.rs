//! Where tables stand in a page.

/// Replaces what stands between `<!-- begin NAME -->` and `<!-- end NAME -->` in `page`. `None` if there is no such place.
pub fn embed(page: &str, name: &str, text: &str) -> Option<String> {
    let (begin, end) = (format!("<!-- begin {name} -->"), format!("<!-- end {name} -->"));
    let from = page.find(&begin)? + begin.len();
    let to = from + page[from..].find(&end)?;
    Some(format!("{}\n\n{}\n\n{}", &page[..from], text.trim(), &page[to..]))
}
