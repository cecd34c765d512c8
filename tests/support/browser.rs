//! Pages in a headless Chromium, driven by the DevTools protocol over a pipe: messages are JSON,
//! each ended by a zero byte.
//!
//! Chromium is `$CHROMIUM`, or the first of `chromium`, `chromium-browser`, `google-chrome` in the
//! path. Where there is none, [`Page::open`] says so and gives none: the test ends there. With
//! `NEARFAR_TEST_BROWSER` set, as `make test` does after installing it, that is a failure instead.
//! WebGL is drawn in software (SwiftShader), so pictures do not depend on the machine's graphics.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use base64::prelude::{BASE64_STANDARD, Engine as _};
use image::RgbImage;
use serde_json::{Value, json};

use super::Folder;

/// Longest wait for an answer; a bound for hangs, far above what a loaded machine needs.
const PATIENCE: Duration = Duration::from_secs(120);

/// One page in a browser of its own, closed when dropped.
#[derive(Debug)]
pub struct Page {
    child: Child,
    input: ChildStdin,
    messages: Receiver<Value>,
    session: String,
    next: u64,
    profile: PathBuf,
    errors: Vec<String>,
    requests: Vec<String>,
    loaded: bool,
}

fn program() -> Option<PathBuf> {
    if let Some(program) = std::env::var_os("CHROMIUM") {
        return Some(program.into());
    }
    let path = std::env::var_os("PATH")?;
    let found = ["chromium", "chromium-browser", "google-chrome"]
        .iter()
        .find_map(|n| std::env::split_paths(&path).map(|d| d.join(n)).find(|p| p.is_file()));
    if found.is_none() {
        assert!(
            std::env::var_os("NEARFAR_TEST_BROWSER").is_none(),
            "NEARFAR_TEST_BROWSER is set and no chromium is there: run ./setup --test"
        );
        eprintln!("SKIPPED: no chromium here; ./setup --test installs it");
    }
    found
}

impl Page {
    /// Opens a file at a viewport of `width`×`height` pixels and waits until it is loaded. None
    /// when there is no browser.
    pub fn open(file: &Path, width: u32, height: u32) -> Option<Self> {
        let mut page = Self::blank(&program()?);
        page.resize(width, height);
        let url = format!("file://{}", std::fs::canonicalize(file).unwrap().display());
        page.call("Page.navigate", json!({ "url": url }));
        let until = Instant::now() + PATIENCE;
        while !page.loaded {
            page.receive(until, "the page to load");
        }
        Some(page)
    }

    fn blank(program: &Path) -> Self {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let profile = std::env::temp_dir().join(format!(
            "nearfar-browser-{}-{}",
            std::process::id(),
            COUNT.fetch_add(1, Ordering::Relaxed)
        ));
        std::fs::create_dir_all(&profile).unwrap();
        // The browser reads commands from descriptor 3 and answers on 4.
        let mut child = Command::new("sh")
            .args(["-c", r#"exec "$@" 3<&0 4>&1 </dev/null >/dev/null 2>&1"#, "sh"])
            .arg(program)
            .args([
                "--headless=new",
                "--remote-debugging-pipe",
                "--no-first-run",
                "--no-sandbox",
                "--disable-dev-shm-usage",
                "--mute-audio",
            ])
            .args([
                "--use-gl=angle",
                "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader",
                "--hide-scrollbars",
                "--force-color-profile=srgb",
            ])
            .args([
                "--disable-background-networking",
                "--disable-component-update",
                "--disable-sync",
                "--no-default-browser-check",
            ])
            .arg(format!("--user-data-dir={}", profile.display()))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let (sender, messages) = channel();
        let mut output = BufReader::new(child.stdout.take().unwrap());
        std::thread::spawn(move || {
            let mut message = Vec::new();
            while output.read_until(0, &mut message).is_ok_and(|n| n > 0) {
                message.pop();
                let Ok(value) = serde_json::from_slice(&message) else { return };
                if sender.send(value).is_err() {
                    return;
                }
                message.clear();
            }
        });
        let input = child.stdin.take().unwrap();
        let mut page = Self {
            child,
            input,
            messages,
            session: String::new(),
            next: 0,
            profile,
            errors: Vec::new(),
            requests: Vec::new(),
            loaded: false,
        };
        let target =
            page.call("Target.createTarget", json!({ "url": "about:blank" }))["targetId"].clone();
        let attach = json!({ "targetId": target, "flatten": true });
        let session = page.call("Target.attachToTarget", attach)["sessionId"].clone();
        page.session = session.as_str().unwrap().to_owned();
        for domain in ["Page", "Runtime", "Log", "Network"] {
            page.call(&format!("{domain}.enable"), json!({}));
        }
        page.loaded = false;
        page
    }

    /// Calls a method of the protocol and gives its result.
    pub fn call(&mut self, method: &str, params: Value) -> Value {
        self.next += 1;
        let id = self.next;
        let mut message = json!({ "id": id, "method": method, "params": params });
        if !self.session.is_empty() {
            message["sessionId"] = self.session.as_str().into();
        }
        let mut bytes = serde_json::to_vec(&message).unwrap();
        bytes.push(0);
        self.input
            .write_all(&bytes)
            .and_then(|()| self.input.flush())
            .unwrap_or_else(|e| panic!("the browser is gone: {e}"));
        let until = Instant::now() + PATIENCE;
        loop {
            let mut answer = self.receive(until, method);
            if answer["id"] == id {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].take();
            }
        }
    }

    fn receive(&mut self, until: Instant, what: &str) -> Value {
        let left = until.saturating_duration_since(Instant::now());
        let message = self.messages.recv_timeout(left).unwrap_or_else(|e| {
            panic!("waiting for {what}: {e}; errors of the page: {:?}", self.errors)
        });
        let params = &message["params"];
        match message["method"].as_str() {
            Some("Page.loadEventFired") => self.loaded = true,
            Some("Network.requestWillBeSent") => {
                self.requests.push(params["request"]["url"].as_str().unwrap_or_default().to_owned())
            }
            Some("Runtime.exceptionThrown") => {
                self.errors.push(params["exceptionDetails"].to_string())
            }
            Some("Runtime.consoleAPICalled")
                if matches!(params["type"].as_str(), Some("error" | "warning" | "assert")) =>
            {
                self.errors.push(params["args"].to_string())
            }
            Some("Log.entryAdded")
                if matches!(params["entry"]["level"].as_str(), Some("error" | "warning")) =>
            {
                self.errors.push(params["entry"]["text"].to_string())
            }
            _ => {}
        }
        message
    }

    /// Sets the viewport, in pixels.
    pub fn resize(&mut self, width: u32, height: u32) {
        self.call(
            "Emulation.setDeviceMetricsOverride",
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false }),
        );
    }

    /// The value of an expression; promises are awaited.
    pub fn evaluate(&mut self, expression: &str) -> Value {
        let mut answer = self.call(
            "Runtime.evaluate",
            json!({ "expression": expression, "returnByValue": true, "awaitPromise": true }),
        );
        assert!(
            answer["exceptionDetails"].is_null(),
            "{expression}: {}",
            answer["exceptionDetails"]
        );
        answer["result"]["value"].take()
    }

    /// Waits until an expression is true.
    pub fn wait_for(&mut self, expression: &str) {
        let until = Instant::now() + PATIENCE;
        while self.evaluate(&format!("!!({expression})")) != true {
            assert!(
                Instant::now() < until,
                "never true: {expression}; errors of the page: {:?}",
                self.errors
            );
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits until what was asked is on the screen.
    pub fn settle(&mut self) {
        self.evaluate(
            "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => done())))",
        );
    }

    /// Moves the mouse, held down (`button` "left", "right") or not ("none").
    pub fn mouse_move(&mut self, at: [f64; 2], button: &str) {
        let buttons = ["none", "left", "right"].iter().position(|b| *b == button).unwrap_or(0);
        let [x, y] = at;
        let event = json!({
            "type": "mouseMoved", "x": x, "y": y, "button": button, "buttons": buttons
        });
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Presses at a place, moves to another in steps and releases there; equal places click.
    pub fn drag(&mut self, from: [f64; 2], to: [f64; 2], button: &str) {
        self.mouse_move(from, "none");
        let end = |kind: &str, [x, y]: [f64; 2]| {
            let mut click = json!({ "type": kind, "x": x, "y": y, "button": button });
            click["clickCount"] = 1.into();
            click
        };
        self.call("Input.dispatchMouseEvent", end("mousePressed", from));
        if from != to {
            for step in 1..=4 {
                let t = f64::from(step) / 4.0;
                self.mouse_move(
                    [from[0] + (to[0] - from[0]) * t, from[1] + (to[1] - from[1]) * t],
                    button,
                );
            }
        }
        self.call("Input.dispatchMouseEvent", end("mouseReleased", to));
    }

    /// Clicks with the left button.
    pub fn click(&mut self, at: [f64; 2]) {
        self.drag(at, at, "left");
    }

    /// Turns the wheel; positive `delta` is towards the user.
    pub fn wheel(&mut self, at: [f64; 2], delta: f64) {
        self.call(
            "Input.dispatchMouseEvent",
            json!({ "type": "mouseWheel", "x": at[0], "y": at[1], "deltaX": 0, "deltaY": delta }),
        );
    }

    /// Fingers on the screen: "touchStart", "touchMove" with their places, "touchEnd" with none.
    pub fn touch(&mut self, kind: &str, at: &[[f64; 2]]) {
        let points: Vec<Value> = at
            .iter()
            .enumerate()
            .map(|(id, p)| json!({ "x": p[0], "y": p[1], "id": id }))
            .collect();
        self.call("Input.dispatchTouchEvent", json!({ "type": kind, "touchPoints": points }));
    }

    /// Presses a key by its name, such as "ArrowLeft", "Tab" or "a".
    pub fn key(&mut self, key: &str) {
        let code = match key {
            "Tab" => 9,
            "Enter" => 13,
            "Escape" => 27,
            " " => 32,
            "End" => 35,
            "Home" => 36,
            "ArrowLeft" => 37,
            "ArrowUp" => 38,
            "ArrowRight" => 39,
            "ArrowDown" => 40,
            _ => u32::from(key.bytes().next().unwrap_or(0).to_ascii_uppercase()),
        };
        let text = if key.len() == 1 { key } else { "" };
        for kind in [if text.is_empty() { "rawKeyDown" } else { "keyDown" }, "keyUp"] {
            let text = if kind == "keyDown" { text } else { "" };
            let event = json!({
                "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code, "text": text
            });
            self.call("Input.dispatchKeyEvent", event);
        }
    }

    /// What the viewport shows, as a PNG file's bytes.
    pub fn screenshot_png(&mut self) -> Vec<u8> {
        self.settle();
        let shot = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        BASE64_STANDARD.decode(shot["data"].as_str().unwrap()).unwrap()
    }

    /// What the viewport shows. With `NEARFAR_SCREENSHOTS` a folder, it is written there as
    /// `name`.png too, to be looked at.
    pub fn screenshot(&mut self, name: &str) -> RgbImage {
        let png = self.screenshot_png();
        if let Some(folder) = std::env::var_os("NEARFAR_SCREENSHOTS") {
            std::fs::write(Path::new(&folder).join(format!("{name}.png")), &png).unwrap();
        }
        image::load_from_memory(&png).unwrap().to_rgb8()
    }

    /// Errors and warnings of the console, exceptions, files that could not be had, since the page
    /// was opened.
    pub fn errors(&mut self) -> &[String] {
        self.settle();
        &self.errors
    }

    /// Addresses of everything that was asked for, the page itself first; `data:` and `blob:` are
    /// no requests to anybody and left out.
    pub fn requests(&mut self) -> Vec<&str> {
        self.settle();
        self.requests
            .iter()
            .map(String::as_str)
            .filter(|r| !r.starts_with("data:") && !r.starts_with("blob:"))
            .collect()
    }

    /// Fails unless the page is silent and asked for nothing but itself.
    pub fn assert_quiet(&mut self) {
        assert!(self.errors().is_empty(), "{:#?}", self.errors);
        let requests = self.requests();
        assert!(requests.len() == 1 && requests[0].starts_with("file://"), "{requests:?}");
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        // Asked to close, it ends its helpers too; killed only when it does not.
        drop(self.input.write_all(b"{\"id\":0,\"method\":\"Browser.close\"}\0"));
        for _ in 0..100 {
            if matches!(self.child.try_wait(), Ok(Some(_))) {
                break;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        drop(self.child.kill());
        drop(self.child.wait());
        drop(std::fs::remove_dir_all(&self.profile));
    }
}

#[test]
fn a_page_is_driven() {
    let folder = Folder::new("page");
    let file = folder.join("page.html");
    let page = r#"<!doctype html><title>t</title><style>body{margin:0;background:#204060}</style>
        <canvas id=c width=50 height=50></canvas><script>
        const log = [];
        for (const e of ['pointerdown', 'wheel', 'keydown', 'touchstart'])
          addEventListener(e, x => log.push(e + (x.key || '')));
        const gl = document.getElementById('c').getContext('webgl2');
        gl.clearColor(1, 0, 0, 1);
        gl.clear(gl.COLOR_BUFFER_BIT);
        </script>"#;
    std::fs::write(&file, page).unwrap();
    let Some(mut page) = Page::open(&file, 400, 300) else { return };
    page.assert_quiet();
    let shot = page.screenshot("driven");
    assert_eq!(
        (shot.dimensions(), shot.get_pixel(300, 200).0, shot.get_pixel(20, 20).0),
        ((400, 300), [0x20, 0x40, 0x60], [255, 0, 0])
    );
    page.click([100.0, 100.0]);
    page.wheel([100.0, 100.0], 100.0);
    page.key("ArrowLeft");
    page.key("a");
    page.touch("touchStart", &[[50.0, 50.0]]);
    page.touch("touchEnd", &[]);
    page.wait_for("log.includes('wheel') && log.includes('touchstart')");
    for event in ["pointerdown", "keydownArrowLeft", "keydowna"] {
        assert_eq!(
            page.evaluate(&format!("log.includes('{event}')")),
            true,
            "{event}: {}",
            page.evaluate("log")
        );
    }
    page.evaluate("console.error('told'); fetch('https://nowhere.invalid/').catch(() => 0)");
    assert!(page.errors()[0].contains("told"));
    assert!(page.requests().contains(&"https://nowhere.invalid/"));
}
