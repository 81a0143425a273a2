//! Lines of OBJ and MTL files: keyword, numbers, and names that may hold spaces.

/// The lines with their numbers from 1; a backslash at the end joins the next line.
pub fn logical_lines(bytes: &[u8]) -> impl Iterator<Item = (usize, String)> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut lines = bytes.split(|&byte| byte == b'\n').zip(1..);
    let text = |line: &[u8]| String::from_utf8_lossy(line.trim_ascii_end()).into_owned();
    std::iter::from_fn(move || {
        let (line, number) = lines.next()?;
        let mut line = text(line);
        while line.ends_with('\\') {
            line.pop();
            line.push(' ');
            match lines.next() {
                Some((next, _)) => line.push_str(&text(next)),
                None => break,
            }
        }
        Some((number, line))
    })
}

/// The first word and what follows it.
pub fn keyword(line: &str) -> (&str, &str) {
    let line = line.trim();
    if line.starts_with('#') {
        return ("", "");
    }
    let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    (word, rest.trim())
}

/// The leading numbers, at most `N`, and how many there are; the rest are 0.
///
/// # Errors
/// For a word that is no finite number.
pub fn numbers<const N: usize>(rest: &str) -> Result<([f32; N], usize), String> {
    let (mut found, mut count) = ([0.0; N], 0);
    for word in rest.split_whitespace().take_while(|word| !word.starts_with('#')).take(N) {
        let number = word.parse().ok().filter(|number: &f32| number.is_finite());
        found[count] = number.ok_or_else(|| format!("“{}” is not a finite number", super::folder::shortened(word)))?;
        count += 1;
    }
    Ok((found, count))
}
