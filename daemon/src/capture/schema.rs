//! Names and texts of the format: profile, topics, schemas.
//!
//! The schemas travel in every file, so that whoever opens a capture in twenty years, with any
//! MCAP tool, finds the layout next to the bytes. A change of layout is a new [`VERSION`].

use foreframe_protocol::PlaneKind;

/// Version of the capture format. A reader understands exactly its own.
pub const VERSION: u32 = 1;

/// Profile in the MCAP header, before the version.
pub(super) const PROFILE_PREFIX: &str = "foreframe-capture/";

/// Topic of the session message, the first of a file.
pub(super) const SESSION_TOPIC: &str = "/session";
/// Topic of gap messages.
pub(super) const GAP_TOPIC: &str = "/gap";

/// A schema record.
pub(super) struct Schema {
    pub(super) name: &'static str,
    pub(super) encoding: &'static str,
    pub(super) text: &'static str,
    /// Encoding of the messages that follow it.
    pub(super) message_encoding: &'static str,
}

pub(super) const SESSION: Schema = Schema {
    name: "foreframe.Session",
    encoding: "jsonschema",
    text: include_str!("schemas/session.json"),
    message_encoding: "json",
};
pub(super) const GAP: Schema = Schema {
    name: "foreframe.Gap",
    encoding: "jsonschema",
    text: include_str!("schemas/gap.json"),
    message_encoding: "json",
};
pub(super) const STREAM: Schema = Schema {
    name: "foreframe.Stream",
    encoding: "text",
    text: include_str!("schemas/stream.txt"),
    message_encoding: "foreframe",
};
pub(super) const FRAME: Schema = Schema {
    name: "foreframe.Frame",
    encoding: "text",
    text: include_str!("schemas/frame.txt"),
    message_encoding: "foreframe",
};
pub(super) const LATE_CAMERA: Schema = Schema {
    name: "foreframe.LateCamera",
    encoding: "text",
    text: include_str!("schemas/late_camera.txt"),
    message_encoding: "foreframe",
};
pub(super) const UI_PLANE: Schema = Schema {
    name: "foreframe.UiPlane",
    encoding: "text",
    text: include_str!("schemas/ui_plane.txt"),
    message_encoding: "foreframe",
};
pub(super) const PLANE: Schema = Schema {
    name: "foreframe.Plane",
    encoding: "text",
    text: include_str!("schemas/plane.txt"),
    message_encoding: "foreframe",
};

/// What a topic carries.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Topic {
    Session,
    Gap,
    Stream(u32),
    Frame(u32),
    LateCamera(u32),
    UiPlane(u32),
    /// Stream, kind, and which one of its kind in the frame, from 0.
    Plane(u32, PlaneKind, u8),
}

impl Topic {
    /// Name in the file.
    pub(super) fn name(self) -> String {
        match self {
            Self::Session => SESSION_TOPIC.to_owned(),
            Self::Gap => GAP_TOPIC.to_owned(),
            Self::Stream(stream) => format!("/stream/{stream}/create"),
            Self::Frame(stream) => format!("/stream/{stream}/submit"),
            Self::LateCamera(stream) => format!("/stream/{stream}/late_camera"),
            Self::UiPlane(stream) => format!("/stream/{stream}/ui_plane"),
            Self::Plane(stream, kind, 0) => format!("/stream/{stream}/{}", kind.name()),
            Self::Plane(stream, kind, which) => format!("/stream/{stream}/{}/{which}", kind.name()),
        }
    }

    /// Inverse of [`Topic::name`]; None for a topic of someone else, which a reader skips.
    pub(super) fn parse(name: &str) -> Option<Self> {
        if name == SESSION_TOPIC {
            return Some(Self::Session);
        }
        if name == GAP_TOPIC {
            return Some(Self::Gap);
        }
        let mut parts = name.strip_prefix("/stream/")?.split('/');
        let stream = parts.next()?.parse().ok()?;
        let what = parts.next()?;
        let topic = match (what, parts.next()) {
            ("create", None) => Self::Stream(stream),
            ("submit", None) => Self::Frame(stream),
            ("late_camera", None) => Self::LateCamera(stream),
            ("ui_plane", None) => Self::UiPlane(stream),
            (kind, which) => {
                Self::Plane(stream, plane_kind(kind)?, which.unwrap_or("0").parse().ok()?)
            }
        };
        (topic.name() == name).then_some(topic)
    }

    pub(super) fn schema(self) -> &'static Schema {
        match self {
            Self::Session => &SESSION,
            Self::Gap => &GAP,
            Self::Stream(_) => &STREAM,
            Self::Frame(_) => &FRAME,
            Self::LateCamera(_) => &LATE_CAMERA,
            Self::UiPlane(_) => &UI_PLANE,
            Self::Plane(..) => &PLANE,
        }
    }
}

fn plane_kind(name: &str) -> Option<PlaneKind> {
    PlaneKind::ALL.iter().copied().find(|kind| kind.name() == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_topic_is_found_again_by_its_name() {
        let mut topics = vec![
            Topic::Session,
            Topic::Gap,
            Topic::Stream(7),
            Topic::Frame(7),
            Topic::LateCamera(7),
            Topic::UiPlane(7),
        ];
        for &kind in PlaneKind::ALL {
            topics.extend([Topic::Plane(1, kind, 0), Topic::Plane(u32::MAX, kind, 3)]);
        }
        for topic in topics {
            assert_eq!(Topic::parse(&topic.name()), Some(topic));
        }
    }

    #[test]
    fn topics_of_others_are_not_ours() {
        for name in [
            "/sessions",
            "/stream/x/color",
            "/stream/1",
            "/stream/1/tint",
            "/stream/01/color",
            "/stream/1/color/0",
            "/stream/1/color/1/2",
            "/tf",
        ] {
            assert_eq!(Topic::parse(name), None, "{name}");
        }
    }
}
