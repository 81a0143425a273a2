//! Moving pictures: GIF (everywhere, 256 colours) and WebP (smaller and truer).

use image::codecs::gif::{GifEncoder, Repeat};
use image::{Delay, Frame, RgbaImage};
use webp_animation::{Encoder, EncoderOptions, EncodingConfig};

use crate::{Error, Result};

/// How long a picture stands, ms: 25 a second, which GIF's hundredths of a second can say.
pub const FRAME_MS: u32 = 40;

/// Quality of WebP frames, 0 to 100: foliage shows no blocks from here on.
const WEBP_QUALITY: f32 = 82.0;

/// Frames of one size as an endless GIF. Each is let go once it is encoded.
///
/// # Errors
/// That of the first frame that is none; [`Error::Internal`] when the encoder refuses one.
pub fn gif(frames: impl IntoIterator<Item = Result<RgbaImage>>) -> Result<Vec<u8>> {
    let failed = |e: image::ImageError| Error::Internal { stage: "writing a GIF", what: e.to_string() };
    let mut bytes = Vec::new();
    {
        let mut encoder = GifEncoder::new_with_speed(&mut bytes, 10);
        encoder.set_repeat(Repeat::Infinite).map_err(failed)?;
        for frame in frames {
            let delay = Delay::from_numer_denom_ms(FRAME_MS, 1);
            encoder.encode_frame(Frame::from_parts(frame?, 0, 0, delay)).map_err(failed)?;
        }
    }
    Ok(bytes)
}

/// Frames of that size as an endless WebP. Each is let go once it is encoded.
///
/// # Errors
/// That of the first frame that is none; [`Error::Internal`] when the encoder refuses one.
pub fn webp([width, height]: [u32; 2], frames: impl IntoIterator<Item = Result<RgbaImage>>) -> Result<Vec<u8>> {
    let failed = |e: webp_animation::Error| Error::Internal { stage: "writing a WebP", what: format!("{e:?}") };
    let config = EncodingConfig::new_lossy(WEBP_QUALITY);
    let options = EncoderOptions { encoding_config: Some(config), ..EncoderOptions::default() };
    let mut encoder = Encoder::new_with_options((width, height), options).map_err(failed)?;
    let mut at_ms = 0;
    for frame in frames {
        encoder.add_frame(frame?.as_raw(), at_ms).map_err(failed)?;
        at_ms += FRAME_MS as i32;
    }
    Ok(encoder.finalize(at_ms).map_err(failed)?.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{AnimationDecoder as _, Rgba};

    fn frames() -> impl Iterator<Item = Result<RgbaImage>> {
        (0..3).map(|i| Ok(RgbaImage::from_pixel(16, 8, Rgba([80 * i, 0, 0, 255]))))
    }

    #[test]
    fn every_frame_comes_back_in_order() {
        let bytes = gif(frames()).unwrap();
        let decoded = image::codecs::gif::GifDecoder::new(std::io::Cursor::new(bytes)).unwrap().into_frames();
        let reds: Vec<u8> = decoded.map(|frame| frame.unwrap().buffer().get_pixel(3, 3)[0]).collect();
        assert!(reds.iter().zip([0u8, 80, 160]).all(|(red, own)| red.abs_diff(own) < 8), "{reds:?}");

        let bytes = webp([16, 8], frames()).unwrap();
        let decoder = webp_animation::Decoder::new(&bytes).unwrap();
        let found: Vec<(i32, u8)> = decoder.into_iter().map(|frame| (frame.timestamp(), frame.data()[0])).collect();
        assert_eq!(found.iter().map(|f| f.0).collect::<Vec<_>>(), [40, 80, 120]);
        assert!(found.iter().zip([0u8, 80, 160]).all(|(f, own)| f.1.abs_diff(own) < 12), "{found:?}");
    }

    #[test]
    fn a_frame_that_fails_ends_it() {
        let broken = || frames().chain([Err(Error::EmptyFile)]);
        assert!(matches!(gif(broken()), Err(Error::EmptyFile)));
        assert!(matches!(webp([16, 8], broken()), Err(Error::EmptyFile)));
    }
}
