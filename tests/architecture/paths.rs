//! Finds paths within the crate in source text without a parser; sufficient for sources formatted by rustfmt.

/// Removes line comments (`://` does not begin one). The sources have no block comments.
pub fn without_comments(text: &str) -> String {
    let code = |line: &str| {
        let is_comment = |at: &usize| !line[..*at].ends_with(':');
        let end = line.match_indices("//").map(|(at, _)| at).find(is_comment).unwrap_or(line.len());
        format!("{}\n", &line[..end])
    };
    text.lines().map(code).collect()
}

/// Returns the module path of a file of `src`: `lod/geomipmap/mod.rs` is `lod::geomipmap`.
pub fn module_of(file: &str) -> Vec<String> {
    let path = file.trim_end_matches(".rs").trim_end_matches("/mod");
    let is_root = ["lib", "main", "internal"].contains(&path);
    path.split('/').filter(|_| !is_root).map(str::to_string).collect()
}

/// Returns every path that begins with `crate` or `super`, resolved from the crate's root, with its line. Inside an
/// inline module `super` resolves as in the enclosing file.
pub fn used(code: &str, module: &[String]) -> Vec<(usize, Vec<String>)> {
    let mut found = Vec::new();
    let starts = words(code).filter(|&(at, word)| {
        ["crate", "super"].contains(&word) && code[at + word.len()..].starts_with("::") && !code[..at].ends_with("::")
    });
    for (at, _) in starts {
        let mut base = module.to_vec();
        let mut rest = &code[at..];
        while let Some(above) = rest.strip_prefix("super::") {
            base.pop();
            rest = above;
        }
        if let Some(root) = rest.strip_prefix("crate::") {
            base.clear();
            rest = root.strip_prefix("internal::").unwrap_or(root);
        }
        found.extend(from(code, at, rest, &base));
    }
    found
}

/// Every path that begins with the name of a child module, resolved in the same way.
pub fn used_children(code: &str, module: &[String], children: &[&str]) -> Vec<(usize, Vec<String>)> {
    let is_start = |&(at, word): &(usize, &str)| {
        let is_first = !code[..at].ends_with("::") || code[..at].ends_with("self::");
        children.contains(&word) && code[at + word.len()..].starts_with("::") && is_first
    };
    words(code).filter(is_start).flat_map(|(at, _)| from(code, at, &code[at..], module)).collect()
}

/// The paths of a use tree at `at` below a base, with its line.
fn from(code: &str, at: usize, text: &str, base: &[String]) -> Vec<(usize, Vec<String>)> {
    let mut paths = Vec::new();
    tree(text, base, &mut paths);
    let line = code[..at].matches('\n').count() + 1;
    paths.into_iter().map(|path| (line, path)).collect()
}

/// Adds the paths of a use tree to `paths` and returns what follows the tree.
fn tree<'a>(text: &'a str, base: &[String], paths: &mut Vec<Vec<String>>) -> &'a str {
    let text = text.trim_start();
    if let Some(mut rest) = text.strip_prefix('{') {
        loop {
            rest = tree(rest, base, paths).trim_start();
            match rest.strip_prefix(',') {
                Some(next) => rest = next,
                None => return rest.strip_prefix('}').unwrap_or(rest),
            }
        }
    }
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len());
    let (name, rest) = text.split_at(end);
    let mut path = base.to_vec();
    if !["", "self"].contains(&name) {
        path.push(name.to_string());
    }
    match rest.strip_prefix("::") {
        Some(next) if !name.is_empty() => tree(next, &path, paths),
        _ => {
            paths.push(path);
            // Skips `*` and renames.
            let rest = rest.strip_prefix('*').unwrap_or(rest);
            rest.strip_prefix(" as ")
                .map_or(rest, |new| new.trim_start_matches(|c: char| c.is_alphanumeric() || c == '_'))
        }
    }
}

/// Returns the lines, from 1, that contain the whole word.
pub fn lines_with_word(code: &str, word: &str) -> Vec<usize> {
    let found = words(code).filter(|&(_, w)| w == word);
    found.map(|(at, _)| code[..at].matches('\n').count() + 1).collect()
}

/// Returns identifiers and keywords with their positions.
fn words(code: &str) -> impl Iterator<Item = (usize, &str)> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut at = 0;
    std::iter::from_fn(move || {
        at += code[at..].find(is_word)?;
        let word = &code[at..];
        let word = &word[..word.find(|c| !is_word(c)).unwrap_or(word.len())];
        at += word.len();
        Some((at - word.len(), word))
    })
}
