//! UI planes between key frames: recorded whole, or known to be damaged.

use foreframe_protocol::{ColorFormat, Rect, UiPlane};

use super::*;

fn ui_stream() -> CreateStream {
    let format = StreamFormat { ui: Some(ColorFormat::Rgba8), ..format() };
    CreateStream { stream: 1, format, max_sizes: format.full_sizes(), slots: 3 }
}

/// Plane `number`, and its pixels.
fn ui(number: u32) -> (CapturedUi, Vec<u8>) {
    let size = PlaneSize { width: 5 + number, height: 3 };
    let valid = Rect { x: 1, y: 0, width: 3, height: 3 };
    let plane = PlaneDescriptor { valid, ..PlaneDescriptor::packed(64, size, 4) };
    let place = [-2, number.cast_signed()];
    let ui = UiPlane { stream: 1, slot: 0, ui_index: u64::from(number), place, plane };
    let arrived_at_ns = 1_000_000_000 + u64::from(number) * INTERVAL_NS / 3;
    let pixels = pattern(u64::from(size.width) * 12, 40 + number);
    (CapturedUi { stream: 0, arrived_at_ns, ui }, pixels)
}

fn write(writer: &mut CaptureWriter<Vec<u8>>, number: u32) -> Result<u64, CaptureError> {
    let (captured, pixels) = ui(number);
    let format = ui_stream().format;
    let plane = &captured.ui.plane;
    let info = PlaneInfo::described(&format, PlaneKind::Ui, plane, None).unwrap();
    writer.ui_plane(captured.arrived_at_ns, &captured.ui, &PlaneBytes::tight(info, &pixels))
}

/// A frame, two UI planes, a frame, a UI plane.
fn written() -> Vec<u8> {
    let mut writer = CaptureWriter::to_writer(Vec::new(), &session()).unwrap();
    writer.add_stream(&ui_stream()).unwrap();
    for (frame, planes) in [(0, 0..2), (1, 2..3)] {
        Sample::new(1, frame).write(&mut writer).unwrap();
        for number in planes {
            write(&mut writer, number).unwrap();
        }
    }
    writer.finish().unwrap()
}

/// Every plane that can be read, with its number among those that were written.
fn read(bytes: &[u8]) -> Option<Vec<u32>> {
    let capture = open(bytes).ok()?;
    let planes: Vec<_> = capture.ui_planes().copied().collect();
    let mut numbers = Vec::new();
    for (position, found) in planes.into_iter().enumerate() {
        let Ok(pixels) = capture.ui_pixels(position) else { continue };
        let number = (0..3).find(|&number| ui(number) == (found, pixels.bytes.clone()));
        numbers.push(number.unwrap_or_else(|| panic!("never written: {found:?}")));
    }
    Some(numbers)
}

#[test]
fn ui_planes_come_back_between_the_frames_as_they_were_written() {
    let bytes = written();
    assert_eq!(read(&bytes).unwrap(), [0, 1, 2]);
    let capture = open(&bytes).unwrap();
    assert_eq!(capture.frame_count(), 2);
    let info = capture.info().unwrap();
    assert_eq!(info.streams[0].ui_planes, 3);
    let listed = info.planes.iter().find(|planes| planes.kind == PlaneKind::Ui).unwrap();
    assert_eq!((listed.count, listed.raw_bytes), (3, 12 * (5 + 6 + 7)));
    assert!(!info.is_truncated() && info.damaged.is_empty());
    assert!(capture.ui_pixels(3).is_err());
}

#[test]
fn a_ui_plane_that_does_not_fit_its_stream_is_refused() {
    let mut writer = CaptureWriter::to_writer(Vec::new(), &session()).unwrap();
    let error = write(&mut writer, 0).unwrap_err().to_string();
    assert!(error.contains("a stream that was added"), "{error}");
    writer.add_stream(&create(1)).unwrap();
    let error = write(&mut writer, 0).unwrap_err().to_string();
    assert!(error.contains("as the stream declares"), "{error}");
    let (mut captured, pixels) = ui(0);
    let mut writer = CaptureWriter::to_writer(Vec::new(), &session()).unwrap();
    writer.add_stream(&ui_stream()).unwrap();
    let format = ui_stream().format;
    let info = PlaneInfo::described(&format, PlaneKind::Ui, &captured.ui.plane, None).unwrap();
    captured.ui.plane.width += 1;
    let plane = PlaneBytes::tight(info, &pixels);
    let error = writer.ui_plane(5, &captured.ui, &plane).unwrap_err().to_string();
    assert!(error.contains("as described"), "{error}");
}

#[test]
fn a_file_cut_off_anywhere_keeps_the_ui_planes_before_the_cut() {
    let bytes = written();
    let mut most = 0;
    for len in 0..bytes.len() {
        let Some(numbers) = read(&bytes[..len]) else { continue };
        assert!(numbers.len() >= most, "{} planes at {len}, {most} before", numbers.len());
        most = numbers.len();
        assert_eq!(numbers, [0, 1, 2][..most]);
    }
    assert_eq!(most, 3);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn no_flipped_bit_changes_a_ui_plane_in_silence(place: prop::sample::Index, bit in 0_u8..8) {
        let mut bytes = written();
        let at = place.index(bytes.len());
        bytes[at] ^= 1_u8 << bit;
        if let Some(numbers) = read(&bytes) {
            let capture = open(&bytes).unwrap();
            let noticed = capture
                .info()
                .is_ok_and(|info| info.is_truncated() || !info.damaged.is_empty())
                || numbers.len() < capture.ui_planes().len();
            prop_assert!(noticed || numbers.len() == 3, "one was lost in silence, byte {at}");
        }
    }
}
