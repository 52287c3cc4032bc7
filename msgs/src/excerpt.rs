/// Letters of a text from outside that are told of.
const MOST: usize = 64;

/// What is told of a text from outside: all of it, or its beginning and how long it is.
pub fn excerpt(text: &str) -> String {
    match text.char_indices().nth(MOST) {
        None => text.to_owned(),
        Some((end, _)) => format!("{}… ({} bytes)", &text[..end], text.len()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_text_is_told_by_its_beginning() {
        let most = "ä".repeat(MOST);
        assert_eq!(excerpt(&most), most);
        let long = "ä".repeat(1 << 20);
        assert_eq!(excerpt(&long), format!("{most}… (2097152 bytes)"));
    }
}
