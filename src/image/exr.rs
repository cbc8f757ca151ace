//! OpenEXR files.
//!
//! Written files have one layer of 32-bit float channels in scan lines with lossless ZIP compression. The data window is
//! the part of the film that was rendered and the display window the whole film, so that viewers put a crop in its place.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use exr::prelude as openexr;
use exr::prelude::{ReadChannels as _, ReadLayers as _, WritableImage as _};

use super::{Attribute, Channel, Image, ImageError, Metadata, Window};

/// Writes `image` to `path`, whole or not at all.
///
/// # Panics
/// When a channel's name is empty or longer than the 255 bytes that the format allows, or occurs twice.
pub fn write(path: &Path, image: &Image) -> Result<(), ImageError> {
    let metadata = &image.metadata;
    let channels = image.channels.iter().map(|channel| {
        let exact =
            channel.name == "sampleCount" || ["Variance.", "m2_"].iter().any(|head| channel.name.starts_with(head));
        let samples = if metadata.half && !exact {
            openexr::FlatSamples::F16(channel.samples.iter().copied().map(openexr::f16::from_f32).collect())
        } else {
            openexr::FlatSamples::F32(channel.samples.clone())
        };
        openexr::AnyChannel::new(text(&channel.name), samples)
    });
    let attributes = openexr::LayerAttributes {
        layer_position: openexr::Vec2(metadata.origin.0, metadata.origin.1),
        world_to_camera: metadata.world_to_camera,
        world_to_normalized_device: metadata.world_to_ndc,
        other: metadata.attributes.iter().map(|(name, value)| (text(name), to_openexr(value))).collect(),
        ..openexr::LayerAttributes::default()
    };
    let encoding = openexr::Encoding {
        compression: openexr::Compression::ZIP16,
        blocks: openexr::Blocks::ScanLines,
        line_order: openexr::LineOrder::Increasing,
    };
    let layer = openexr::Layer::new(
        (image.width, image.height),
        attributes,
        encoding,
        openexr::AnyChannels::sort(channels.collect()),
    );
    let display = openexr::IntegerBounds::new(
        (metadata.display.x, metadata.display.y),
        (metadata.display.width, metadata.display.height),
    );
    let file_image = openexr::Image::new(openexr::ImageAttributes::new(display), layer);
    super::write_whole(path, |file| {
        file_image.write().to_buffered(file).map_err(|error| match error {
            openexr::Error::Io(source) => source,
            other => std::io::Error::other(other.to_string()),
        })
    })
}

/// Reads every float or integer channel of every layer of `path`. Of a file with several layers, a channel's name begins
/// with that of its layer; the layers must then cover the same pixels. Deep images and channels that skip pixels are
/// errors. Of several resolutions the largest is read.
pub fn read(path: &Path) -> Result<Image, ImageError> {
    let format_error = |cause: String| ImageError::Format { path: path.to_owned(), cause };
    let read_error = |source| ImageError::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(read_error)?;
    let contents = openexr::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_buffered(BufReader::new(file))
        .map_err(|error| match error {
            openexr::Error::Io(source) => read_error(source),
            openexr::Error::Invalid(cause) => format_error(format!("not a valid OpenEXR file: {cause}")),
            openexr::Error::NotSupported(cause) => format_error(format!("OpenEXR feature not supported: {cause}")),
            openexr::Error::Aborted => format_error("reading was aborted".to_owned()),
        })?;

    let several = contents.layer_data.len() > 1;
    let first = contents.layer_data.first().ok_or_else(|| format_error("the file has no layer".to_owned()))?;
    let bounds = first.absolute_bounds();
    let mut image = Image {
        width: first.size.width(),
        height: first.size.height(),
        channels: Vec::new(),
        metadata: metadata(&contents.attributes, &first.attributes),
    };
    for layer in &contents.layer_data {
        if layer.absolute_bounds() != bounds {
            return Err(format_error("its layers cover different pixels".to_owned()));
        }
        let layer_name = layer.attributes.layer_name.as_ref().map(string).filter(|name| several && !name.is_empty());
        for channel in &layer.channel_data.list {
            let name = match &layer_name {
                Some(layer) => format!("{layer}.{}", string(&channel.name)),
                None => string(&channel.name),
            };
            if channel.sampling != openexr::Vec2(1, 1) {
                return Err(format_error(format!("channel {name} does not have a sample for every pixel")));
            }
            image.channels.push(Channel { name, samples: channel.sample_data.values_as_f32().collect() });
        }
    }
    image.sort_channels();
    Ok(image)
}

/// The header of the file's first layer, as far as it is of types that this program uses.
fn metadata(shared: &openexr::ImageAttributes, own: &openexr::LayerAttributes) -> Metadata {
    let display = shared.display_window;
    Metadata {
        origin: (own.layer_position.x(), own.layer_position.y()),
        display: Window {
            x: display.position.x(),
            y: display.position.y(),
            width: display.size.width(),
            height: display.size.height(),
        },
        world_to_camera: own.world_to_camera,
        world_to_ndc: own.world_to_normalized_device,
        half: false,
        attributes: (shared.other.iter().chain(&own.other))
            .filter_map(|(name, value)| Some((string(name), from_openexr(value)?)))
            .collect(),
    }
}

fn to_openexr(value: &Attribute) -> openexr::AttributeValue {
    match value {
        Attribute::Text(value) => openexr::AttributeValue::Text(text(value)),
        Attribute::Int(value) => openexr::AttributeValue::I32(*value),
        Attribute::Float(value) => openexr::AttributeValue::F32(*value),
        Attribute::Double(value) => openexr::AttributeValue::F64(*value),
    }
}

fn from_openexr(value: &openexr::AttributeValue) -> Option<Attribute> {
    match value {
        openexr::AttributeValue::Text(value) => Some(Attribute::Text(string(value))),
        openexr::AttributeValue::I32(value) => Some(Attribute::Int(*value)),
        openexr::AttributeValue::F32(value) => Some(Attribute::Float(*value)),
        openexr::AttributeValue::F64(value) => Some(Attribute::Double(*value)),
        _ => None,
    }
}

/// Strings in the file are bytes without a declared encoding; ours are UTF-8.
fn text(string: &str) -> openexr::Text {
    openexr::Text::from_slice_unchecked(string.as_bytes())
}

fn string(text: &openexr::Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}
