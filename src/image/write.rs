//! Encodes images as files: EXR holds radiance, PNG what a screen shows of it.

use super::Image;
use super::colour_maps::VIRIDIS;
use super::difference::clip;
use crate::error::Error;

use exr::prelude::{
    AttributeValue, Compression, Encoding, Image as ExrImage, Layer, LayerAttributes, LineOrder,
    SpecificChannels, Text, WritableImage,
};
use std::io::Cursor;

/// The name of the attribute of an EXR file that holds the text.
const ATTRIBUTE: &str = "brdfit";

/// Encodes as EXR: scan lines from the top, ZIP compression in blocks of sixteen lines, 32-bit channels R, G and B, with
/// `text`, for example JSON, in the attribute `brdfit`.
///
/// The same image and text give the same bytes. A second attribute would break this, since the writer keeps attributes
/// in a hash map, whose order changes from run to run.
///
/// # Errors
/// [`Error::Invalid`] if the number of pixels does not match, [`Error::Encoding`] if the text is empty.
pub fn exr(image: &Image, text: &str) -> Result<Vec<u8>, Error> {
    image.check()?;
    let mut rows = image.pixels.chunks_exact(image.width).map(<[[f64; 3]]>::to_vec).collect::<Vec<_>>();
    rows.iter_mut().flatten().for_each(|pixel| *pixel = pixel.map(|v| if v.is_finite() { v } else { 0.0 }));
    let channels = SpecificChannels::rgb(|position: exr::math::Vec2<usize>| {
        let [r, g, b] = rows[position.y()][position.x()].map(single);
        (r, g, b)
    });
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: exr::image::Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let layer = Layer::new((image.width, image.height), LayerAttributes::default(), encoding, channels);
    let mut file = ExrImage::from_layer(layer);
    let value = AttributeValue::Text(Text::from(text));
    file.attributes.other.insert(Text::from(ATTRIBUTE), value);
    let mut bytes = Cursor::new(Vec::new());
    file.write()
        .non_parallel()
        .to_buffered(&mut bytes)
        .map_err(|error| Error::Encoding { format: "EXR", reason: error.to_string() })?;
    Ok(bytes.into_inner())
}

/// Encodes as PNG: eight bits per channel with the transfer curve of sRGB, after `exposure` and clipping to 0..1.
///
/// # Errors
/// [`Error::Invalid`] if the number of pixels does not match, or a side is longer than the format allows.
pub fn png(image: &Image, exposure: f64) -> Result<Vec<u8>, Error> {
    image.check()?;
    let side = |n: usize| {
        let expected = || format!("at most {} pixels on a side of a PNG", u32::MAX);
        u32::try_from(n).map_err(|_| Error::invalid("image", expected(), n.to_string()))
    };
    let failed = |error: png::EncodingError| Error::Encoding { format: "PNG", reason: error.to_string() };
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side(image.width)?, side(image.height)?);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    let data: Vec<u8> = image.pixels.iter().flatten().map(|value| byte(encode(value * exposure))).collect();
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&data).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

/// Width of the line between two images, pixels.
const GAP: usize = 4;
/// Linear RGB of the line, and of the area below an image that is less high than the others.
const GREY: [f64; 3] = [0.2; 3];

/// Places the images side by side from left to right, aligned at the top, with a grey line between them.
///
/// All get the same exposure; if theirs differ, apply [`Image::exposed`] first.
///
/// # Errors
/// [`Error::Invalid`] if there is no image, or the number of pixels of one does not match.
pub fn side_by_side(images: &[&Image]) -> Result<Image, Error> {
    images.iter().try_for_each(|image| image.check())?;
    let height = images.iter().map(|image| image.height).max().unwrap_or(0);
    let width = images.iter().map(|image| image.width).sum::<usize>() + GAP * images.len().saturating_sub(1);
    let mut pixels = Vec::with_capacity(width * height);
    for y in 0..height {
        for (index, image) in images.iter().enumerate() {
            if index > 0 {
                pixels.extend([GREY; GAP]);
            }
            match image.pixels.chunks_exact(image.width).nth(y) {
                Some(row) => pixels.extend_from_slice(row),
                None => pixels.extend(std::iter::repeat_n(GREY, image.width)),
            }
        }
    }
    Image::new(width, height, pixels)
}

/// Places images of the same size in rows of `columns`, with a grey line between them. Places that are left are grey.
///
/// # Errors
/// [`Error::Invalid`] as for [`side_by_side`].
pub fn in_rows(images: &[Image], columns: usize) -> Result<Image, Error> {
    let rows = images.chunks(columns.max(1)).map(|row| side_by_side(&row.iter().collect::<Vec<_>>()));
    let rows: Vec<Image> = rows.collect::<Result<_, _>>()?;
    let width = rows.iter().map(|row| row.width).max().unwrap_or(0);
    let (mut pixels, mut height) = (Vec::new(), 0);
    for (index, row) in rows.iter().enumerate() {
        if index > 0 {
            pixels.extend(std::iter::repeat_n(GREY, GAP * width));
            height += GAP;
        }
        for line in row.pixels.chunks_exact(row.width) {
            pixels.extend_from_slice(line);
            pixels.extend(std::iter::repeat_n(GREY, width - row.width));
        }
        height += row.height;
    }
    Image::new(width, height, pixels)
}

/// Makes a false-colour image of values, to be shown at exposure 1, in the colours of [`VIRIDIS`]: violet at 0, yellow at `top` and
/// above, black outside the mask.
///
/// # Errors
/// [`Error::Invalid`] if the number of values does not match.
pub fn false_colour(
    width: usize,
    height: usize,
    values: &[f64],
    mask: &[bool],
    top: f64,
) -> Result<Image, Error> {
    let colour = |value: f64| {
        // NaN has the colour of 0.
        let t = if top > 0.0 && value > 0.0 { value / top } else { 0.0 };
        VIRIDIS.at(t).map(|value| decode(value / 255.0))
    };
    let pixels = values.iter().zip(mask).map(|(value, is)| if *is { colour(*value) } else { [0.0; 3] });
    Image::new(width, height, pixels.collect())
}

/// The transfer curve of sRGB (IEC 61966-2-1), from linear 0..1 to 0..1.
fn encode(linear: f64) -> f64 {
    let linear = clip(linear);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The inverse of `encode`: from sRGB 0..1 to linear 0..1.
pub(crate) fn decode(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "rounded, and within 0 to 255")]
fn byte(value: f64) -> u8 {
    // NaN becomes 0.
    (clip(value) * 255.0).round() as u8
}

#[expect(clippy::cast_possible_truncation, reason = "EXR holds single precision")]
fn single(value: f64) -> f32 {
    // Values beyond the range of single precision would be written as infinity.
    value.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::count;

    fn ramp(width: usize, height: usize) -> Image {
        let pixels = (0..width * height).map(|i| {
            let x = count(i) / count(width * height);
            [x, x * x * 3.0, 1e3 * x]
        });
        Image::new(width, height, pixels.collect()).unwrap()
    }

    #[test]
    fn exr_is_stable_and_reads_back() {
        let image = ramp(37, 41);
        let text = r#"{"scene":"sphere","pixels":1517}"#;
        let bytes = exr(&image, text).unwrap();
        assert_eq!(bytes, exr(&image, text).unwrap());
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), &bytes).unwrap();
        let back = exr::prelude::read_first_rgba_layer_from_file(
            file.path(),
            |size, _| vec![[0.0_f32; 3]; size.area()],
            |pixels, at, (r, g, b, _): (f32, f32, f32, f32)| pixels[at.y() * 37 + at.x()] = [r, g, b],
        )
        .unwrap();
        let expected: Vec<[f32; 3]> = image.pixels.iter().map(|pixel| pixel.map(single)).collect();
        assert_eq!(back.layer_data.channel_data.pixels, expected);
        let attributes = &back.layer_data.attributes.other;
        assert_eq!(attributes.len(), 1);
        assert_eq!(attributes[&Text::from(ATTRIBUTE)], AttributeValue::Text(Text::from(text)));
        assert!(exr(&Image { width: 2, height: 2, pixels: vec![] }, text).is_err());
    }

    #[test]
    fn png_is_stable_and_reads_back() {
        let image =
            Image::new(2, 2, vec![[0.0; 3], [0.25, 0.5, 1.0], [f64::NAN; 3], [-1.0, 0.107, 7.0]]).unwrap();
        let bytes = png(&image, 2.0).unwrap();
        assert_eq!(bytes, png(&image, 2.0).unwrap());
        let mut reader = png::Decoder::new(Cursor::new(&bytes)).read_info().unwrap();
        assert!(reader.info().srgb.is_some());
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut data).unwrap();
        // Half of white is 188, 0.214 is mid grey 127 or 128 in every table of sRGB.
        assert_eq!(data[..6], [0, 0, 0, 188, 255, 255]);
        assert_eq!(data[6..10], [0, 0, 0, 0]);
        assert!((127..=128).contains(&data[10]));
        assert_eq!(data[11], 255);
    }

    #[test]
    fn transfer_curve_and_inverse() {
        for i in 0..=255 {
            let encoded = f64::from(i) / 255.0;
            approx::assert_abs_diff_eq!(encode(decode(encoded)), encoded, epsilon = 1e-7);
        }
    }

    #[test]
    fn panels_and_maps() {
        let (a, b) = (ramp(3, 2), ramp(2, 4));
        let both = side_by_side(&[&a, &b]).unwrap();
        assert_eq!((both.width, both.height), (9, 4));
        assert_eq!(both.pixels[9 + 2], a.pixels[5]);
        assert_eq!(both.pixels[3 * 9 + 8], b.pixels[7]);
        assert!(side_by_side(&[]).is_err());

        let map = false_colour(4, 1, &[0.0, 5.0, 20.0, 1.0], &[true, true, true, false], 10.0).unwrap();
        let bytes = |pixel: [f64; 3]| pixel.map(|v| byte(encode(v)));
        assert_eq!(
            map.pixels.iter().map(|p| bytes(*p)).collect::<Vec<_>>(),
            [[68, 1, 84], [33, 145, 140], [253, 231, 37], [0, 0, 0]]
        );
        // Lightness increases steadily along the map.
        let values: Vec<f64> = (0..=100).map(f64::from).collect();
        let ramp = false_colour(101, 1, &values, &[true; 101], 100.0).unwrap();
        let lightness: Vec<f64> = ramp.pixels.iter().map(|p| super::super::lab(*p)[0]).collect();
        assert!(lightness.windows(2).all(|pair| pair[1] > pair[0]));
    }
}
