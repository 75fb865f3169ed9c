//! Pages in a headless Chromium, for tests.
//!
//! Without one on the machine such a test says that it is skipped and why, and how many were;
//! `FOREFRAME_REQUIRE_BROWSER=1` makes that an error.

use std::fs;
use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

const NAMES: [&str; 4] =
    ["chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"];
/// The page has so long, of its own clock, to do what the script asks. That clock runs ahead while
/// pictures are decoded: a script that looks every millisecond has looked this often by then, which
/// is longer than a busy machine takes.
const BUDGET_MS: u32 = 1_000_000;

static SKIPPED: AtomicU32 = AtomicU32::new(0);

/// Opens `page` with `script` at its end, and returns its document once nothing moves any more.
/// None, and a line on standard error, where there is no browser.
pub(crate) fn in_browser(test: &str, page: &str, script: &str) -> Option<String> {
    let Some(browser) = find() else {
        assert!(
            std::env::var_os("FOREFRAME_REQUIRE_BROWSER").is_none(),
            "{test}: expected one of {} on the path, found none",
            NAMES.join(", ")
        );
        let count = SKIPPED.fetch_add(1, Ordering::Relaxed) + 1;
        // Straight to the stream: the test runner swallows what tests print.
        writeln!(io::stderr(), "skipped ({count}): {test}: no headless Chromium").unwrap();
        return None;
    };
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("page.html");
    fs::write(&path, page.replace("</body>", &format!("<script>{script}</script></body>")))
        .unwrap();
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"])
        .arg(format!("--virtual-time-budget={BUDGET_MS}"))
        .arg(format!("--user-data-dir={}", dir.path().join("profile").display()))
        .arg(format!("file://{}", path.display()))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8(output.stdout).unwrap())
}

fn find() -> Option<PathBuf> {
    let folders: Vec<_> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
    let files = NAMES.iter().flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    files.into_iter().find(|file| file.is_file())
}
