// `fathom render` and `fathom view` from outside: files, errors, and what a browser and a window show.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "render/image.hpp"
#include "test_folder.hpp"

namespace {

using fathom::render::Image;
using fathom::render::read_png;
using fathom::test::read_text;
using testing::HasSubstr;
namespace fs = std::filesystem;

struct Outcome {
  int exit_code = -1;
  std::string out, err;
};

bool has_program(const std::string& name) {
  return std::system(("command -v " + name + " >/dev/null 2>&1").c_str()) == 0;
}

class Pictures : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }

  /// A shell command line, run in the test's folder, where "fathom" is the program.
  Outcome shell(const std::string& line) const {
    const std::string command = "cd '" + folder_.path().string() +
                                "' && fathom() { '" FATHOM_PROGRAM "' \"$@\"; } && { " + line + "; } > out 2> err";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, read_text(path("out")), read_text(path("err"))};
  }

  fathom::test::TestFolder folder_;
};

/// How much the pixels of a part of the picture (fractions of its width) vary: near 0 for an empty one.
double variation(const Image& image, double left = 0, double right = 1) {
  double sum = 0, squares = 0, count = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = static_cast<int>(left * image.width); x < static_cast<int>(right * image.width); ++x) {
      const std::uint8_t* p = image.row(y) + 3 * x;
      const double v = (p[0] + p[1] + p[2]) / 3.0;
      sum += v;
      squares += v * v;
      ++count;
    }
  }
  return std::sqrt(std::max(0.0, squares / count - sum / count * (sum / count)));
}

constexpr const char* small = " --gpu software --size 160x90 --quiet ";

TEST_F(Pictures, AreWrittenAtTheirTimes) {
  const Outcome outcome = shell("fathom render pyramid --layers 3 --at 0.5s,0 -o shots --gpu software --size 160x90");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "shots/pyramid-000.00s.png\nshots/pyramid-000.50s.png\n");
  for (const char* name : {"shots/pyramid-000.00s.png", "shots/pyramid-000.50s.png"}) {
    const Image image = read_png(path(name));
    EXPECT_EQ(image.width, 160);
    EXPECT_EQ(image.height, 90);
    EXPECT_GT(variation(image), 10);
  }
}

TEST_F(Pictures, OneMayHaveANameOfItsOwn) {
  const Outcome outcome = shell(std::string("fathom render drift --bodies 20 --at 0 -o one.png") + small);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_GT(variation(read_png(path("one.png"))), 5);
}

TEST_F(Pictures, AreDrawnFromARecording) {
  const Outcome outcome = shell(std::string("fathom run spread --bodies 9 --steps 60 --record run.rec --quiet && "
                                            "fathom render run.rec --at 0.5 -o rec.png") +
                                small + "&& fathom render spread --bodies 9 --at 0.5 -o run.png" + small);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_LT(fathom::render::difference(read_png(path("rec.png")), read_png(path("run.png")), 32).mean, 1);
}

TEST_F(Pictures, ARecordingBeginsAtItsBeginningAndSaysWhereItEnds) {
  const std::string render = std::string("fathom render ");
  ASSERT_EQ(shell("fathom run drift --bodies 20 --steps 30 --record run.rec --quiet && "
                  "fathom play drift --bodies 20 --steps 30 --quiet --set record.file=play.rec")
                .exit_code,
            0);
  ASSERT_EQ(shell(render + "drift --bodies 20 --at 0 -o at0.png" + small).exit_code, 0);
  for (const char* recording : {"run.rec", "play.rec"}) {
    ASSERT_EQ(shell(render + recording + " --at 0 -o rec0.png" + small).exit_code, 0);
    EXPECT_EQ(read_png(path("rec0.png")).pixels, read_png(path("at0.png")).pixels) << recording << " before step 1";
    const Outcome beyond = shell(render + recording + " --at 0.5,100 -o shots" + small);
    EXPECT_EQ(beyond.exit_code, 2);
    EXPECT_EQ(beyond.err, std::string("fathom: ") + recording +
                              " ends at 0.5 s, but times up to 100 s were asked for; ask for earlier ones\n");
    EXPECT_EQ(std::distance(fs::directory_iterator(path("shots")), fs::directory_iterator()), 1);
    fs::remove_all(path("shots"));
    // Times nearest to the first or the last state are available.
    EXPECT_EQ(shell(render + recording + " --at 1e-9,0.505 -o shots" + small).exit_code, 0) << recording;
    EXPECT_EQ(shell(render + recording + " --at 1e-9 -o shots" + small).exit_code, 0) << recording;
    EXPECT_EQ(std::distance(fs::directory_iterator(path("shots")), fs::directory_iterator()), 2);
    fs::remove_all(path("shots"));
    EXPECT_EQ(shell(render + recording + " --web page.html --quiet").exit_code, 0) << "to its end, where nobody says";
    EXPECT_EQ(shell(render + recording + " --web page.html --seconds 1 --quiet").exit_code, 2);
  }
}

TEST_F(Pictures, EachTimeHasItsOwnFile) {
  const Outcome outcome =
      shell("fathom render drift --bodies 5 --at 0.101,0.102,0.1,0.1 -o shots --gpu software --size 160x90");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "shots/drift-000.10s.png\nshots/drift-000.101s.png\nshots/drift-000.102s.png\n");
}

TEST_F(Pictures, AFilmHasAllItsFrames) {
  if (!has_program("ffmpeg") || !has_program("ffprobe")) GTEST_SKIP() << "there is no ffmpeg here";
  const Outcome outcome =
      shell(std::string("fathom render drift --bodies 20 --video film.mp4 --seconds 0.5 --fps 30") + small +
            "&& ffprobe -v error -count_frames -show_entries stream=width,nb_read_frames -of csv=p=0 film.mp4");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "160,16\n");
}

TEST_F(Pictures, APageShowsItsBodiesInABrowser) {
  ASSERT_EQ(shell("fathom render layers --bodies 100 --web page.html --seconds 1 --quiet").exit_code, 0);
  EXPECT_LT(fs::file_size(path("page.html")), 300'000u);
  if (!has_program("chromium")) GTEST_SKIP() << "there is no chromium here to show the page";
  const std::string browser =
      "timeout 120 chromium --headless --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader "
      "--hide-scrollbars "
      "--window-size=640,360 --virtual-time-budget=5000 --user-data-dir=profile ";
  const std::string page = "'file://" + path("page.html") + "#t=0.5&paused'";
  const Outcome dom = shell(browser + "--dump-dom " + page);
  if (dom.out.empty()) GTEST_SKIP() << "chromium does not run here: " << dom.err;
  EXPECT_THAT(dom.out, HasSubstr("data-state=\"ready\""));
  EXPECT_THAT(dom.out, HasSubstr("data-bodies=\"100\""));
  EXPECT_THAT(dom.out, testing::Not(HasSubstr("data-error")));
  ASSERT_EQ(shell(browser + "--screenshot=page.png " + page).exit_code, 0);
  EXPECT_GT(variation(read_png(path("page.png")), 0.3, 0.7), 25);
}

// On a phone nothing is off the screen, and a wide scene is not cut off.
TEST_F(Pictures, APageFitsANarrowScreen) {
  if (!has_program("chromium")) GTEST_SKIP() << "there is no chromium here to show the page";
  ASSERT_EQ(shell("fathom render spread --bodies 100 --web page.html --seconds 1 --quiet").exit_code, 0);
  // Frames can be as narrow as requested, a browser's window cannot.
  std::ofstream(path("page.html"), std::ios::app) << R"(<script>
    const timer = setInterval(() => {
      if (document.documentElement.dataset.state !== 'ready') return;
      clearInterval(timer);
      const outside = [...document.querySelectorAll('#bar, #bar *, #title')].filter(e => {
        const box = e.getBoundingClientRect();
        return !(box.left >= 0 && box.right <= innerWidth && box.bottom <= innerHeight && box.width > 20);
      });
      parent.postMessage(`${location.hash}: ${document.getElementById('time').textContent}, ${outside.length} outside`,
        '*');
    }, 50);
  </script>)";
  std::ofstream(path("phones.html")) << R"(<body><script>
    addEventListener('message', event => document.body.append(event.data + ';'));
    for (const start of ['abc', '9'])
      document.write(`<iframe style="position: fixed; top: 0; width: 390px; height: 844px" src="page.html#t=${start}&paused"></iframe>`);
  </script>)";
  const std::string browser =
      "timeout 120 chromium --headless --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader "
      "--hide-scrollbars --window-size=390,844 --virtual-time-budget=4000 --user-data-dir=profile ";
  const Outcome dom = shell(browser + "--dump-dom 'file://" + path("phones.html") + "'");
  if (dom.out.empty()) GTEST_SKIP() << "chromium does not run here: " << dom.err;
  for (const char* said : {"#t=abc&amp;paused: 0.00 / 1.0 s, 0 outside;", "#t=9&amp;paused: 1.00 / 1.0 s, 0 outside;"})
    EXPECT_THAT(dom.out, HasSubstr(said));
  ASSERT_EQ(shell(browser + "--screenshot=page.png 'file://" + path("page.html") + "#paused'").exit_code, 0);
  const Image image = read_png(path("page.png"));
  EXPECT_EQ(image.width, 390);
  // The ground is grey, unlike the bodies.
  const auto colourful = [&](int from, int to) {
    int count = 0;
    for (int y = image.height / 4; y < image.height * 3 / 4; ++y)
      for (int x = from; x < to; ++x) {
        const std::uint8_t* p = image.row(y) + 3 * x;
        count += std::max({p[0], p[1], p[2]}) - std::min({p[0], p[1], p[2]}) > 60;
      }
    return count;
  };
  EXPECT_GT(colourful(0, image.width), 5000);
  EXPECT_EQ(colourful(0, 5) + colourful(image.width - 5, image.width), 0);
}

TEST_F(Pictures, AWindowShowsTheRunUnderXvfb) {
  if (!has_program("xvfb-run")) GTEST_SKIP() << "there is no xvfb-run here";
  const Outcome outcome =
      shell("LIBGL_ALWAYS_SOFTWARE=1 timeout 200 xvfb-run -a -s '-screen 0 800x600x24' '" FATHOM_PROGRAM
            "' view pyramid --layers 4 --frames 5 --overlays points,normals,impulses,boxes,graph,joints,reactions "
            "--size 640x400 "
            "--screenshot window.png");
  if (outcome.exit_code != 0 && outcome.err.find("xvfb-run: error") != std::string::npos) GTEST_SKIP() << outcome.err;
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const Image image = read_png(path("window.png"));
  EXPECT_EQ(image.width, 640);
  EXPECT_GT(variation(image, 0, 0.5), 20);   // the panel
  EXPECT_GT(variation(image, 0.55, 1), 12);  // the bodies
}

struct BadLine {
  std::string line, says;
};

TEST_F(Pictures, BadRequestsAreOneLineAndExitCode2) {
  std::ofstream(path("file")) << "no folder";
  const std::string drift = "fathom render drift --bodies 5 ";
  const BadLine lines[] = {
      {drift, "nothing to draw; ask for pictures (--at 0,5,10s)"},
      {drift + "--at soon", "--at must be times like 0,5,10s"},
      {drift + "--at 1,-2", "--at must be times like 0,5,10s"},
      {drift + "--at 1 --size 5x5", "must be WIDTHxHEIGHT"},
      {drift + "--at 1 --size 64", "must be WIDTHxHEIGHT"},
      {drift + "--at 1 --gpu fast", "--gpu must be auto, software or a device's number, not fast"},
      {drift + "--at 1 --gpu 63", "there is no graphics device 63"},
      {drift + "--at 0 --azimuth nan", "--azimuth: must be a number from -360 to 360, not nan"},
      {drift + "--at 0 --elevation inf", "--elevation: must be a number from -360 to 360, not inf"},
      {drift + "--at 0 --turn=-361", "--turn: must be a number from -360 to 360, not -361"},
      {drift + "--at 0 --zoom nan", "--zoom: must be a number from 0.05 to 50, not nan"},
      {drift + "--seconds nan --at 0", "must be a finite number greater than 0 and at most 1000000, not nan"},
      {drift + "--video film", "film: a film needs an ending; use .mp4, .mkv, .webm or .gif"},
      {"fathom view drift --overlay points", "'fathom view' has no option --overlay; did you mean --overlays?"},
      {drift + "--at 1 --look night", "must be daylight|water, not night"},
      {drift + "--at 1 --colour mood", "must be island|speed|start, not mood"},
      {drift + "--at 1 -o file/shots", "the folder cannot be created"},
      {drift + "--at 1,2 -o one.png", "is one picture, but --at asks for 2"},
      {drift + "--web /nowhere/page.html", "/nowhere/page.html: cannot be written"},
      {drift + "--video /nowhere/film.mp4", "/nowhere/film.mp4: cannot be written"},
      {drift + "--video film.mp4 --size 161x90", "films need an even width and height, not 161x90"},
      {drift + "--video film.mp4 --fps 0", "must be a whole number from 1"},
      {"PATH=/nowhere " + drift + "--video film.mp4", "install the package ffmpeg"},
      {"fathom render nothing --at 1", "there is no environment 'nothing'"},
      {"unset DISPLAY WAYLAND_DISPLAY; fathom view drift", "no window can be opened"},
      {"fathom view drift --overlays point", "did you mean 'points'?"},
  };
  for (const BadLine& bad : lines) {
    const Outcome outcome = shell(bad.line);
    EXPECT_EQ(outcome.exit_code, 2) << bad.line << "\n" << outcome.err;
    EXPECT_EQ(outcome.out, "") << bad.line;
    EXPECT_THAT(outcome.err, HasSubstr(bad.says)) << bad.line;
    EXPECT_THAT(outcome.err, testing::StartsWith("fathom: ")) << bad.line;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << bad.line << "\n" << outcome.err;
  }
}

TEST_F(Pictures, WithoutADriverTheRemedyIsNamed) {
  const Outcome outcome = shell("__EGL_VENDOR_LIBRARY_FILENAMES=/nowhere fathom render drift --bodies 5 --at 0");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_THAT(outcome.err, HasSubstr("drawing without a window"));
  EXPECT_THAT(outcome.err, HasSubstr("install libegl1"));
  const Outcome old = shell("MESA_GL_VERSION_OVERRIDE=3.3 fathom render drift --bodies 5 --at 0 --gpu software");
  EXPECT_EQ(old.exit_code, 2) << old.err;
  EXPECT_THAT(old.err, HasSubstr("4.5"));
}

TEST_F(Pictures, AFilmThatFfmpegRefusesIsReported) {
  if (!has_program("ffmpeg")) GTEST_SKIP() << "there is no ffmpeg here";
  const Outcome outcome =
      shell(std::string("fathom render drift --bodies 5 --video film.nonsense --seconds 0.1") + small);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_EQ(outcome.err,
            "fathom: film.nonsense: .nonsense is not the ending of a film; use .mp4, .mkv, .webm or .gif\n");
  EXPECT_EQ(shell("fathom render drift --at 0 -o pictures --video film.nonsense").exit_code, 2);
  EXPECT_FALSE(fs::exists(path("pictures")));
  // An ffmpeg that gives up midway: reports its first message, and leaves nothing behind.
  std::ofstream(path("ffmpeg")) << "#!/bin/sh\nfor last; do :; done\necho \"${last#file:}: no room\" >&2\nexit 1\n";
  fs::permissions(path("ffmpeg"), fs::perms::owner_all);
  const Outcome gave_up =
      shell(std::string("PATH=.:$PATH; fathom render drift --bodies 5 --video film.mp4 --seconds 0.1") + small);
  EXPECT_EQ(gave_up.exit_code, 2);
  EXPECT_EQ(gave_up.err,
            "fathom: film.mp4: ffmpeg gave up: film.mp4: no room; check the file's ending and the space left\n");
  EXPECT_EQ(folder_.file_count(), 3u) << "out, err and ffmpeg";
}

}  // namespace
