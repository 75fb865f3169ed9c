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
    let [compared, failed] = [compared, failed].map(|count| count.to_string());
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let suite = xml.create_element("testsuite").with_attributes([
        ("name", comparison.capture.as_str()),
        ("tests", &compared),
        ("failures", &failed),
    ]);
    suite.write_inner_content(|xml| {
        for method in &comparison.methods {
            let class = format!("{}.{}", comparison.capture, method.name);
            for (name, failure) in cases(method) {
                write_case(xml, [&class, name], failure.as_deref())?;
            }
        }
        Ok(())
    })?;
    Ok(String::from_utf8(xml.into_inner())? + "\n")
}

/// What was compared, and what is said of it where it failed.
fn cases(method: &MethodComparison) -> Vec<(&'static str, Option<String>)> {
    let failure = |passed: bool, said: String| (!passed).then_some(said);
    let digest = failure(method.digest.passed, method.digest.to_text());
    let metrics = method
        .quality
        .iter()
        .map(|metric| (metric.metric.name(), failure(metric.passed, metric.to_text())));
    std::iter::once(("digest", digest)).chain(metrics).collect()
}

fn write_case(
    xml: &mut Writer<Vec<u8>>,
    [class, name]: [&str; 2],
    failure: Option<&str>,
) -> io::Result<()> {
    let case =
        xml.create_element("testcase").with_attributes([("classname", class), ("name", name)]);
    match failure {
        None => case.write_empty()?,
        Some(said) => case.write_inner_content(|xml| {
            xml.create_element("failure").write_text_content(BytesText::new(said)).map(|_| ())
        })?,
    };
    Ok(())
}
