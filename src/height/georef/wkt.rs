//! Well-known text of coordinate reference systems, both versions, read for units and ellipsoid.

use proj4wkt::parser::{Attribute, Processor, parse as parse_tree};

use super::crs::Crs;
use super::ellipsoid::Ellipsoid;
use super::mercator::is_web_mercator;
use super::registry;
use super::unit::Unit;

/// Brackets within brackets; systems in use stay below 12.
const MAX_DEPTH: usize = 32;

const PROJECTED: [&str; 3] = ["PROJCS", "PROJCRS", "PROJECTEDCRS"];
const GEOGRAPHIC: [&str; 5] = ["GEOGCS", "GEOGCRS", "GEOGRAPHICCRS", "GEODCRS", "GEODETICCRS"];
const VERTICAL: [&str; 4] = ["VERT_CS", "VERTCS", "VERTCRS", "VERTICALCRS"];
const LOCAL: [&str; 4] = ["LOCAL_CS", "ENGCRS", "ENGINEERINGCRS", "ENGINEERCRS"];
const UNITS: [&str; 3] = ["UNIT", "LENGTHUNIT", "ANGLEUNIT"];

/// Reads a system, or a horizontal and a vertical system one after the other as ESRI writes them.
pub fn parse(text: &str) -> Option<Crs> {
    if !text.contains('[') || depth(text) > MAX_DEPTH {
        return None;
    }
    let set = format!("SET[{}]", text.trim().trim_end_matches('\0'));
    let systems = parse_tree(&set, &Tree).ok()?;
    systems.crs()
}

/// The deepest nesting of brackets outside quotes.
fn depth(text: &str) -> usize {
    let (mut depth, mut deepest, mut is_quoted) = (0usize, 0, false);
    for byte in text.bytes() {
        match byte {
            b'"' => is_quoted = !is_quoted,
            b'[' if !is_quoted => depth += 1,
            b']' if !is_quoted => depth = depth.saturating_sub(1),
            _ => (),
        }
        deepest = deepest.max(depth);
    }
    deepest
}

/// A keyword with what stands in its brackets.
#[derive(Debug)]
struct Node {
    key: String,
    texts: Vec<String>,
    numbers: Vec<f64>,
    labels: Vec<String>,
    children: Vec<Node>,
}

struct Tree;

impl<'a> Processor<'a> for Tree {
    type Err = std::io::Error;
    type Output = Node;

    fn process<I>(&self, key: &'a str, _: usize, attributes: I) -> Result<Node, Self::Err>
    where
        I: Iterator<Item = Attribute<'a, Node>>,
    {
        let key = key.to_uppercase();
        let mut node = Node { key, texts: Vec::new(), numbers: Vec::new(), labels: Vec::new(), children: Vec::new() };
        for attribute in attributes {
            match attribute {
                Attribute::Quoted(text) => node.texts.push(text.to_owned()),
                Attribute::Number(text) => node.numbers.push(text.parse().unwrap_or(f64::NAN)),
                Attribute::Label(text) => node.labels.push(text.to_uppercase()),
                Attribute::Keyword(_, child) => node.children.push(child),
            }
        }
        Ok(node)
    }
}

impl Node {
    fn is(&self, keys: &[&str]) -> bool {
        keys.contains(&self.key.as_str())
    }

    fn child(&self, keys: &[&str]) -> Option<&Node> {
        self.children.iter().find(|child| child.is(keys))
    }

    /// The first node of these keys, depth first.
    fn find(&self, keys: &[&str]) -> Option<&Node> {
        self.children.iter().find_map(|child| if child.is(keys) { Some(child) } else { child.find(keys) })
    }

    /// The system that a node describes, or that its children describe together.
    fn crs(&self) -> Option<Crs> {
        if self.is(&PROJECTED) {
            return Some(Crs { unit: Some(self.projected_unit()), name: self.name(), ..Crs::default() });
        }
        if self.is(&GEOGRAPHIC) {
            return self.geographic();
        }
        if self.is(&LOCAL) {
            let unit = self.unit().map_or(1.0, |(_, size)| size);
            return Some(Crs { unit: Some(Unit::Metres(unit)), name: self.name(), ..Crs::default() });
        }
        if self.is(&VERTICAL) {
            return Some(self.vertical());
        }
        if self.is(&["SET", "COMPD_CS", "COMPOUNDCRS", "BOUNDCRS", "SOURCECRS"]) {
            return self.children.iter().filter_map(Node::crs).reduce(Crs::and);
        }
        None
    }

    /// Name of the unit and its size in metres or radians: one of all axes, or of the first.
    fn unit(&self) -> Option<(&str, f64)> {
        let of_axis = || self.children.iter().filter(|child| child.is(&["AXIS"])).find_map(|axis| axis.child(&UNITS));
        let unit = self.child(&UNITS).or_else(of_axis)?;
        let size = *unit.numbers.first()?;
        (size.is_finite() && size > 0.0).then(|| (unit.texts.first().map_or("", String::as_str), size))
    }

    fn projected_unit(&self) -> Unit {
        let method = self.find(&["PROJECTION", "METHOD"]).and_then(|node| node.texts.first());
        let code = self.name();
        let names = [self.texts.first(), method, code.as_ref()];
        let is_mercator = names.into_iter().flatten().any(|name| is_web_mercator(name));
        let is_earth = self.ellipsoid().is_none_or(|ellipsoid| ellipsoid.is_earth());
        match self.unit() {
            _ if is_mercator && is_earth => Unit::Mercator,
            Some((_, size)) => Unit::Metres(size),
            None => Unit::Metres(1.0),
        }
    }

    fn geographic(&self) -> Option<Crs> {
        let is_cartesian =
            self.child(&["CS"]).is_some_and(|cs| cs.labels.iter().any(|label| label.eq_ignore_ascii_case("CARTESIAN")));
        if is_cartesian {
            return None;
        }
        let radians = self.unit().map_or(1f64.to_radians(), |(_, size)| size);
        let ellipsoid = self.ellipsoid().unwrap_or(Ellipsoid::WGS84);
        let up = self.children.iter().find(|child| child.is(&["AXIS"]) && child.labels.iter().any(|l| l == "UP"));
        let height_unit = up.and_then(|axis| axis.child(&UNITS)).and_then(|unit| unit.numbers.first().copied());
        let unit = Some(Unit::Angles { radians, ellipsoid });
        Some(Crs { unit, height_unit, name: self.name(), is_depth: false })
    }

    fn vertical(&self) -> Crs {
        let by_code = || registry::vertical(self.epsg()?)?.height_unit;
        let is_down = |label: &String| label == "DOWN";
        let by_axis = self.children.iter().any(|child| child.is(&["AXIS"]) && child.labels.iter().any(is_down));
        // ESRI states the direction as a parameter.
        let by_parameter = self.children.iter().any(|child| {
            let is_direction = child.texts.first().is_some_and(|name| name.eq_ignore_ascii_case("direction"));
            child.is(&["PARAMETER"]) && is_direction && child.numbers.first().is_some_and(|&n| n < 0.0)
        });
        let height_unit = self.unit().map(|(_, size)| size).or_else(by_code);
        Crs { height_unit, is_depth: by_axis || by_parameter, ..Crs::default() }
    }

    fn ellipsoid(&self) -> Option<Ellipsoid> {
        let node = self.find(&["SPHEROID", "ELLIPSOID"])?;
        let [a, inverse, ..] = node.numbers[..] else { return None };
        let unit = node.child(&UNITS).and_then(|unit| unit.numbers.first().copied()).unwrap_or(1.0);
        Ellipsoid::new(a * unit, if inverse == 0.0 { 0.0 } else { 1.0 / inverse })
    }

    /// Authority and code, else the name.
    fn name(&self) -> Option<String> {
        let by_code = self.child(&["AUTHORITY", "ID"]).and_then(|id| {
            let code = id.texts.get(1).cloned().or_else(|| id.numbers.first().map(f64::to_string))?;
            Some(format!("{}:{code}", id.texts.first()?))
        });
        by_code.or_else(|| self.texts.first().cloned())
    }

    fn epsg(&self) -> Option<u32> {
        self.name()?.strip_prefix("EPSG:")?.parse().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = r#"COMPD_CS["a",PROJCS["b",GEOGCS["c",DATUM["d",SPHEROID["e",6378137,298.25]],UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],UNIT["Foot_US",0.3048006096012192],AXIS["Easting",EAST]],VERT_CS["v",VERT_DATUM["w",2005],UNIT["foot",0.3048],AXIS["Depth",DOWN]]]"#;

    #[test]
    fn a_text_cut_short_or_damaged_is_none_and_no_panic() {
        let whole = parse(TEXT).unwrap();
        assert_eq!(whole.unit, Some(Unit::Metres(0.3048006096012192)));
        assert_eq!((whole.height_unit, whole.is_depth), (Some(0.3048), true));
        for end in 0..TEXT.len() {
            assert!(parse(&TEXT[..end]).is_none(), "{end}");
        }
        let mut dice = fastrand::Rng::with_seed(7);
        for _ in 0..5000 {
            let mut bytes = TEXT.as_bytes().to_vec();
            for _ in 0..dice.usize(1..6) {
                let (at, with) = (dice.usize(..bytes.len()), dice.choice(b"[]\",-1eA \0").copied());
                bytes[at] = with.unwrap_or(b'x');
            }
            let _ = parse(&String::from_utf8_lossy(&bytes));
        }
        assert!(parse(&"A[".repeat(100_000)).is_none());
        assert!(parse("").is_none() && parse("[]").is_none() && parse("A[]").is_none());
    }
}
