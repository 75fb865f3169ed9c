//! The synthesis methods that users can name.

use std::fmt;
use std::str::FromStr;

/// How an in-between frame is made.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub enum Method {
    /// Nothing moves: the newest key again.
    Hold,
    /// Mean of the two keys around the content time. Interpolates.
    Blend,
    /// Both keys around the content time, filtered along the motion between them (Falchetto et al.
    /// 2007). Interpolates.
    Voxel,
    /// The newest key sampled backwards through its own motion field: the plain baseline.
    Gather,
    /// Grid warp snapped to motion discontinuities (Didyk et al. 2010, section 6).
    Grid,
    /// Scatter of depth and source offset along the motion field, then a gather of colour.
    #[default]
    Linear,
    /// As `linear`, along one homography for the whole image.
    Global,
    /// As `linear`, along the local affine map of the motion field, continued as its own power.
    Affine,
    /// As `linear`, along velocity and acceleration from the last two motion fields.
    Quadratic,
    /// As `linear`, seen by a camera that goes on along its own path; needs depth and cameras.
    World,
    /// As `linear`, along motion estimated from the two newest pictures; needs no motion plane, and
    /// takes no notice of one.
    Flow,
    /// The ladder: for every surface the cheapest of `hold`, `global`, `linear`, `affine`,
    /// `quadratic` and `world` that the last keys have shown to be good enough, and `flow` where
    /// motion does not explain them.
    Auto,
}

impl Method {
    /// Every method, in the order in which tables list them.
    pub const ALL: [Self; 12] = [
        Self::Hold,
        Self::Blend,
        Self::Voxel,
        Self::Gather,
        Self::Grid,
        Self::Linear,
        Self::Global,
        Self::Affine,
        Self::Quadratic,
        Self::World,
        Self::Flow,
        Self::Auto,
    ];

    /// Name on the command line, in reports and in JSON.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Blend => "blend",
            Self::Voxel => "voxel",
            Self::Gather => "gather",
            Self::Grid => "grid",
            Self::Linear => "linear",
            Self::Global => "global",
            Self::Affine => "affine",
            Self::Quadratic => "quadratic",
            Self::World => "world",
            Self::Flow => "flow",
            Self::Auto => "auto",
        }
    }

    /// The method whose warp makes its frames: the rungs of the ladder differ in the trajectories
    /// that they give a key, and share the warp of `linear`.
    #[must_use]
    pub const fn warp(self) -> Self {
        match self {
            Self::Hold | Self::Blend | Self::Voxel | Self::Gather | Self::Grid | Self::Linear => {
                self
            }
            Self::Global
            | Self::Affine
            | Self::Quadratic
            | Self::World
            | Self::Flow
            | Self::Auto => Self::Linear,
        }
    }

    /// Whether it goes by motion, and so by an estimate where a key has none.
    #[must_use]
    pub const fn follows_motion(self) -> bool {
        !matches!(self, Self::Hold | Self::Blend)
    }

    /// Whether it follows cameras, and so late ones too.
    #[must_use]
    pub const fn knows_cameras(self) -> bool {
        matches!(self, Self::World | Self::Auto)
    }

    /// Whether it needs the key after the content time, and so shows everything one interval late.
    #[must_use]
    pub const fn interpolates(self) -> bool {
        matches!(self, Self::Blend | Self::Voxel)
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A method name that does not exist.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("expected one of {}, found `{found}`", Method::ALL.map(Method::name).join(", "))]
pub struct UnknownMethod {
    /// What was asked for.
    pub found: String,
}

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(name: &str) -> Result<Self, UnknownMethod> {
        Self::ALL
            .into_iter()
            .find(|method| method.name() == name)
            .ok_or_else(|| UnknownMethod { found: name.to_owned() })
    }
}
