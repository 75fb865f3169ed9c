//! One EXR file in memory: channels by name, whatever part they stand in.

use std::path::Path;

use anyhow::{Context as _, bail};
use exr::prelude::{FlatImage, FlatSamples, ReadChannels as _, ReadLayers as _};
use half::f16;

/// The channels of an EXR file.
#[derive(Debug)]
pub struct ExrImage {
    name: String,
    image: FlatImage,
}

/// One channel.
#[derive(Clone, Copy, Debug)]
pub struct Channel<'a> {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Values, row by row.
    pub samples: &'a FlatSamples,
}

impl ExrImage {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// If it cannot be read, is no EXR file, or uses something that cannot be read.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let name = path.display().to_string();
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .from_file(path)
            .with_context(|| format!("{name}: expected an EXR file that can be read"))?;
        Ok(Self { name, image })
    }

    /// The channel of this name. In a file of several parts, `PART.CHANNEL` is meant.
    #[must_use]
    pub fn channel(&self, wanted: &str) -> Option<Channel<'_>> {
        self.image.layer_data.iter().find_map(|layer| {
            let part = layer.attributes.layer_name.as_ref().map(ToString::to_string);
            let found = layer.channel_data.list.iter().find(|channel| {
                let name = channel.name.to_string();
                name == wanted
                    || part.as_ref().is_some_and(|part| format!("{part}.{name}") == wanted)
            })?;
            let width = u32::try_from(layer.size.0).ok()?;
            let height = u32::try_from(layer.size.1).ok()?;
            Some(Channel { width, height, samples: &found.sample_data })
        })
    }

    /// Names of all channels, for errors.
    #[must_use]
    pub fn channel_names(&self) -> String {
        let layers = self.image.layer_data.iter();
        let names = layers.flat_map(|layer| &layer.channel_data.list);
        names.map(|channel| channel.name.to_string()).collect::<Vec<_>>().join(", ")
    }

    /// The channels of these names, all of the same size.
    ///
    /// # Errors
    /// If one is missing or has another size than the first.
    pub fn channels<const N: usize>(&self, wanted: [&str; N]) -> anyhow::Result<[Channel<'_>; N]> {
        let mut found = Vec::with_capacity(N);
        for name in wanted {
            let Some(channel) = self.channel(name) else {
                let has = self.channel_names();
                bail!("{}: expected a channel `{name}`, found {has}", self.name);
            };
            found.push(channel);
        }
        let size = |channel: &Channel<'_>| (channel.width, channel.height);
        if let Some(other) = found.iter().find(|channel| size(channel) != size(&found[0])) {
            bail!(
                "{}: expected channels {} of one size, found {:?} and {:?}",
                self.name,
                wanted.join(", "),
                size(&found[0]),
                size(other)
            );
        }
        Ok(found.try_into().expect("as many as wanted"))
    }
}

impl<'a> Channel<'a> {
    /// Half floats.
    ///
    /// # Errors
    /// If the channel has another type. `what` names it.
    pub fn halves(self, what: &str) -> anyhow::Result<&'a [f16]> {
        match self.samples {
            FlatSamples::F16(samples) => Ok(samples),
            other => bail!("{what}: expected half floats, found {}", type_name(other)),
        }
    }

    /// Floats. Halves are widened, which loses nothing.
    ///
    /// # Errors
    /// If the channel holds integers. `what` names it.
    pub fn floats(self, what: &str) -> anyhow::Result<Vec<f32>> {
        match self.samples {
            FlatSamples::F32(samples) => Ok(samples.clone()),
            FlatSamples::F16(samples) => Ok(samples.iter().map(|half| half.to_f32()).collect()),
            other => bail!("{what}: expected floats, found {}", type_name(other)),
        }
    }

    /// Unsigned integers.
    ///
    /// # Errors
    /// If the channel has another type. `what` names it.
    pub fn integers(self, what: &str) -> anyhow::Result<&'a [u32]> {
        match self.samples {
            FlatSamples::U32(samples) => Ok(samples),
            other => bail!("{what}: expected integers, found {}", type_name(other)),
        }
    }
}

fn type_name(samples: &FlatSamples) -> &'static str {
    match samples {
        FlatSamples::F16(_) => "half floats",
        FlatSamples::F32(_) => "floats",
        FlatSamples::U32(_) => "integers",
    }
}
