//! A writer of SVG: elements, numbers with two decimals, escaped text.

use super::typeset::{Run, runs};
use crate::figure::text::Text;
use std::fmt::Write as _;

/// The font of all text: whatever the reader has without serifs.
const FONT: &str = "Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans', sans-serif";

/// A drawing in points, from the top left.
#[derive(Debug)]
pub(super) struct Svg {
    body: String,
    /// Number of clipping rectangles so far.
    clips: usize,
}

/// How a shape is painted.
#[derive(Clone, Debug, Default)]
pub(super) struct Paint<'a> {
    /// The colour of the inside; empty for none.
    pub(super) fill: &'a str,
    /// How much of the inside covers what is behind, 0 to 1.
    pub(super) opacity: f64,
    /// The colour of the line; empty for none.
    pub(super) stroke: &'a str,
    /// The width of the line.
    pub(super) width: f64,
    /// The lengths of dashes and gaps; empty for a solid line.
    pub(super) dash: &'a str,
    /// Whether the ends of lines are round.
    pub(super) round: bool,
}

impl<'a> Paint<'a> {
    /// An opaque inside.
    pub(super) fn fill(fill: &'a str) -> Self {
        Self { fill, opacity: 1.0, ..Self::default() }
    }

    /// A line.
    pub(super) fn stroke(stroke: &'a str, width: f64) -> Self {
        Self { stroke, width, ..Self::default() }
    }

    fn attributes(&self) -> String {
        let mut text = match self.fill {
            "" => " fill=\"none\"".to_owned(),
            fill if self.opacity < 1.0 => {
                format!(" fill=\"{fill}\" fill-opacity=\"{}\"", number(self.opacity))
            }
            fill => format!(" fill=\"{fill}\""),
        };
        if !self.stroke.is_empty() {
            let _ = write!(text, " stroke=\"{}\" stroke-width=\"{}\"", self.stroke, number(self.width));
        }
        if self.round {
            text.push_str(" stroke-linecap=\"round\"");
        }
        if !self.dash.is_empty() {
            let _ = write!(text, " stroke-dasharray=\"{}\"", self.dash);
        }
        text
    }
}

/// Where the anchor of a text lies in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

impl Anchor {
    fn name(self) -> &'static str {
        match self {
            Self::Start => "start",
            Self::Middle => "middle",
            Self::End => "end",
        }
    }
}

/// The place of a text's baseline, and how the text is set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Setting {
    pub(super) at: [f64; 2],
    pub(super) size: f64,
    pub(super) anchor: Anchor,
    /// Whether it runs upwards.
    pub(super) upwards: bool,
    pub(super) bold: bool,
}

/// The name that stands in a drawing for its own identity, until all of it is known.
const IDENTITY: &str = "\u{1}";

impl Svg {
    pub(super) fn new() -> Self {
        Self { body: String::new(), clips: 0 }
    }

    pub(super) fn path(&mut self, data: &str, paint: &Paint<'_>) {
        if !data.is_empty() {
            let _ = writeln!(self.body, "<path d=\"{data}\"{}/>", paint.attributes());
        }
    }

    pub(super) fn line(&mut self, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], paint: &Paint<'_>) {
        self.path(&format!("M{} {}L{} {}", number(x1), number(y1), number(x2), number(y2)), paint);
    }

    pub(super) fn rectangle(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], paint: &Paint<'_>) {
        let numbers = [x, y, width, height].map(number);
        let [x, y, width, height] = &numbers;
        let _ = writeln!(
            self.body,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"{}/>",
            paint.attributes()
        );
    }

    pub(super) fn circle(&mut self, [x, y]: [f64; 2], radius: f64, paint: &Paint<'_>) {
        let [x, y, radius] = [x, y, radius].map(number);
        let _ = writeln!(self.body, "<circle cx=\"{x}\" cy=\"{y}\" r=\"{radius}\"{}/>", paint.attributes());
    }

    /// A PNG inside the drawing, stretched to the rectangle.
    pub(super) fn image(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2], png: &[u8]) {
        use base64::Engine as _;
        let content = base64::prelude::BASE64_STANDARD.encode(png);
        let [x, y, width, height] = [x, y, width, height].map(number);
        let _ = writeln!(
            self.body,
            "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" preserveAspectRatio=\"none\" href=\"data:image/png;base64,{content}\"/>"
        );
    }

    pub(super) fn text(&mut self, text: &Text, setting: Setting) {
        let Setting { at: [x, y], size, anchor, upwards, bold } = setting;
        let [x, y] = [x, y].map(number);
        let turn = if upwards { format!(" transform=\"rotate(-90 {x} {y})\"") } else { String::new() };
        let weight = if bold { " font-weight=\"bold\"" } else { "" };
        let _ = writeln!(
            self.body,
            "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" text-anchor=\"{}\"{weight}{turn}>{}</text>",
            number(size),
            anchor.name(),
            content(text, size)
        );
    }

    /// Begins a group that shows only what is inside a rectangle.
    pub(super) fn begin_clip(&mut self, [x, y]: [f64; 2], [width, height]: [f64; 2]) {
        self.clips += 1;
        let clip = self.clips;
        let [x, y, width, height] = [x, y, width, height].map(number);
        let _ = writeln!(
            self.body,
            "<clipPath id=\"{IDENTITY}-{clip}\"><rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\"/></clipPath>\n\
             <g clip-path=\"url(#{IDENTITY}-{clip})\">"
        );
    }

    /// Adds all that another drawing has.
    pub(super) fn append(&mut self, other: Self) {
        self.body.push_str(&other.body);
        self.clips += other.clips;
    }

    pub(super) fn end_group(&mut self) {
        self.body.push_str("</g>\n");
    }

    /// The whole document, `width` and `height` in points. Its identity, with which all its ids begin, follows from what is in it
    /// and from `place`.
    pub(super) fn document(
        self,
        [width, height]: [f64; 2],
        place: &str,
        title: &str,
        description: &str,
    ) -> String {
        use sha2::{Digest as _, Sha256};
        let digest = Sha256::digest(format!("{place}{width} {height} {description}\n{}", self.body));
        let mut identity = "brdfit".to_owned();
        for byte in digest.iter().take(6) {
            let _ = write!(identity, "{byte:02x}");
        }
        let millimetres = |points: f64| number(points * 25.4 / 72.0);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\" aria-labelledby=\"{identity}-title {identity}-description\" \
             width=\"{}mm\" height=\"{}mm\" viewBox=\"0 0 {} {}\" font-family=\"{FONT}\" fill=\"#000\" stroke-linejoin=\"round\">\n\
             <title id=\"{identity}-title\">{}</title>\n<desc id=\"{identity}-description\">{}</desc>\n{}</svg>\n",
            millimetres(width),
            millimetres(height),
            number(width),
            number(height),
            escaped(title),
            escaped(description),
            self.body.replace(IDENTITY, &identity)
        )
    }
}

/// The content of a text element.
fn content(text: &Text, size: f64) -> String {
    let mut content = String::new();
    // How far the baseline is below that of the text.
    let mut below = 0.0;
    for Run { text, shift, italic } in runs(text) {
        let wanted = shift * size;
        let style = if italic { " font-style=\"italic\"" } else { "" };
        let moved = wanted - below;
        below = wanted;
        let text = escaped(&text);
        if moved == 0.0 && style.is_empty() && shift == 0.0 {
            content.push_str(&text);
            continue;
        }
        let dy = if moved == 0.0 { String::new() } else { format!(" dy=\"{}\"", number(moved)) };
        let smaller = if shift == 0.0 {
            String::new()
        } else {
            format!(" font-size=\"{}\"", number(super::typeset::SMALLER * size))
        };
        let _ = write!(content, "<tspan{dy}{smaller}{style}>{text}</tspan>");
    }
    content
}

/// A number with up to two decimals; 0 if it is not finite.
pub(super) fn number(x: f64) -> String {
    if !x.is_finite() {
        return "0".to_owned();
    }
    let text = format!("{x:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// Text with everything escaped that would end it, and without characters that XML forbids.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&apos;"),
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        let all = [1.0, 0.125, -0.001, 1234.5, f64::NAN, f64::INFINITY].map(number);
        assert_eq!(all, ["1", "0.12", "0", "1234.5", "0", "0"]);
    }

    #[test]
    fn text_cannot_leave_its_element() {
        let mut svg = Svg::new();
        let setting =
            Setting { at: [0.0, 0.0], size: 7.0, anchor: Anchor::Start, upwards: false, bold: false };
        svg.text(&Text::from("</text><script>a & 'b' \"c\"\u{1}\u{0}"), setting);
        let text = svg.document([10.0, 10.0], "", "<t>", "d\u{7}");
        assert!(
            text.contains("&lt;/text&gt;&lt;script&gt;a &amp; &apos;b&apos; &quot;c&quot;  </text>"),
            "{text}"
        );
        assert!(!text.contains("<script>") && !text.contains('\u{1}') && !text.contains('\u{7}'), "{text}");
    }
}
