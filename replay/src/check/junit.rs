//! A comparison as JUnit XML, which CI services show: a case per digest and metric.

use std::io;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesText, Event};

use super::{Comparison, MethodComparison};

/// The file.
///
/// # Errors
/// Never: memory can be written.
pub fn junit(comparison: &Comparison) -> anyhow::Result<String> {
    let (compared, failed) = comparison.counts();
    let skipped = comparison.methods.iter().filter(|method| !method.digest.is_asked).count();
    let [cases, failed, skipped] =
        [compared + skipped, failed, skipped].map(|count| count.to_string());
    let capture = printable(&comparison.capture);
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let suite = xml.create_element("testsuite").with_attributes([
        ("name", capture.as_str()),
        ("tests", &cases),
        ("failures", &failed),
        ("skipped", &skipped),
    ]);
    suite.write_inner_content(|xml| {
        for method in &comparison.methods {
            let class = format!("{capture}.{}", method.name);
            for (name, outcome) in outcomes(method) {
                write_case(xml, [&class, name], &outcome)?;
            }
        }
        Ok(())
    })?;
    Ok(String::from_utf8(xml.into_inner())? + "\n")
}

/// `text` without what XML 1.0 cannot hold.
fn printable(text: &str) -> String {
    text.chars().filter(|c| !c.is_control()).collect()
}

/// What became of a case.
enum Outcome {
    Passed,
    Skipped,
    /// With what is said of it.
    Failed(String),
}

/// What was compared.
fn outcomes(method: &MethodComparison) -> Vec<(&'static str, Outcome)> {
    let outcome = |passed: bool, said: String| match passed {
        true => Outcome::Passed,
        false => Outcome::Failed(said),
    };
    let digest = match method.digest.is_asked {
        true => outcome(method.digest.passed, method.digest.to_text()),
        false => Outcome::Skipped,
    };
    let metrics = method
        .quality
        .iter()
        .map(|metric| (metric.metric.name(), outcome(metric.passed, metric.to_text())));
    std::iter::once(("digest", digest)).chain(metrics).collect()
}

fn write_case(
    xml: &mut Writer<Vec<u8>>,
    [class, name]: [&str; 2],
    outcome: &Outcome,
) -> io::Result<()> {
    let case =
        xml.create_element("testcase").with_attributes([("classname", class), ("name", name)]);
    match outcome {
        Outcome::Passed => case.write_empty()?,
        Outcome::Skipped => {
            case.write_inner_content(|xml| xml.create_element("skipped").write_empty().map(|_| ()))?
        }
        Outcome::Failed(said) => case.write_inner_content(|xml| {
            xml.create_element("failure").write_text_content(BytesText::new(said)).map(|_| ())
        })?,
    };
    Ok(())
}
