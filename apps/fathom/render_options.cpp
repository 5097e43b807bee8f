#include "render_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>

#include "picture_options.hpp"
#include "render/video.hpp"
#include "validators.hpp"

namespace fathom::cli {
namespace {

/// "1.5" or "1.5s"; throws for anything else.
double seconds_of(std::string_view text) {
  const std::string_view number = text.ends_with("s") ? text.substr(0, text.size() - 1) : text;
  double value = 0;
  const auto [end, failure] = std::from_chars(number.data(), number.data() + number.size(), value);
  if (failure != std::errc() || end != number.data() + number.size() || !(value >= 0 && value <= longest_film)) {
    throw Error(ErrorCode::invalid_argument,
                "--at must be times like 0,5,10s (up to 1000000 s), not '" + std::string(text) + "'");
  }
  return value;
}

/// Whether the name would be taken for that of a folder, although it is not meant to be one.
bool is_other_picture(const std::string& name) {
  constexpr std::string_view endings[] = {".jpg", ".jpeg", ".bmp", ".gif", ".webp", ".tif", ".tiff", ".svg", ".PNG"};
  return std::ranges::any_of(endings, [&](std::string_view ending) { return name.ends_with(ending); });
}

void declare_degrees(CLI::App& command, const std::string& flag, float& radians, const std::string& help) {
  command
      .add_option_function<double>(
          flag, [&radians](double degrees) { radians = static_cast<float>(degrees) * pi / 180; }, help)
      ->type_name("DEG")
      ->check(number_between(-360, 360))
      ->group("Camera");
}

}  // namespace

std::vector<double> RenderOptions::times() const {
  std::vector<double> times;
  if (at.empty()) return times;
  std::string_view rest = at;
  for (std::size_t comma = rest.find(','); comma != rest.npos; comma = rest.find(',')) {
    times.push_back(seconds_of(rest.substr(0, comma)));
    rest.remove_prefix(comma + 1);
  }
  times.push_back(seconds_of(rest));
  return times;
}

void RenderOptions::check() const {
  const auto require = [](bool makes_sense, const char* complaint) {
    if (!makes_sense) throw Error(ErrorCode::invalid_argument, complaint);
  };
  const bool pictures = !at.empty(), page = !web.empty(), films = page || !video.empty();
  require(pictures || films,
          "nothing to draw; ask for pictures (--at 0,5,10s), a film (--video FILE.mp4) or a page (--web FILE.html)");
  require(pictures || output.empty(), "-o is where pictures go; say of which times, e.g. --at 0,5,10s");
  require(films || !seconds, "--seconds is the length of a film or page; add --video FILE.mp4 or --web FILE.html");
  require(films || !frames_per_second, "--fps is that of a film or page; add --video FILE.mp4 or --web FILE.html");
  require(!is_other_picture(output), "-o: pictures are PNG; let its name end in .png, or give a folder");
  if (!video.empty()) render::film_ending(video);  // before a folder of pictures is made
  const bool draws = pictures || !video.empty();
  require(draws || !(stage.contacts || stage.joints),
          "a page shows no contacts or joints; leave --contacts and --joints out, or add --at or --video");
  const render::StageSettings unset;
  require(
      draws || (stage.width == unset.width && stage.height == unset.height && stage.enlargement == unset.enlargement),
      "a page fills the browser's window; leave --size and --samples out, or add --at or --video");
}

void declare_render(CLI::App& command, RenderOptions& options) {
  declare_scene(command, options.run);
  command.add_option("--at", options.at, "Simulated times to write pictures of, e.g. 0,5,10s")->type_name("TIMES");
  command.add_option("-o,--output", options.output, "Folder of the pictures, or the one picture's file (shots)")
      ->type_name("FOLDER|FILE.png");
  command.add_option("--video", options.video, "Write a film with the program ffmpeg; the ending is the format")
      ->type_name("FILE.mp4");
  command.add_option("--web", options.web, "Write one page that plays the run in a browser")->type_name("FILE.html");
  command.add_option("--seconds", options.seconds, "Length of the film or page (10 s)")
      ->type_name("S")
      ->check(positive_number(longest_film));
  command.add_option("--fps", options.frames_per_second, "Frames per simulated second of the film (60) or page (30)")
      ->type_name("N")
      ->check(whole_number(1, 240));
  declare_picture_size(command, options.stage.width, options.stage.height, "Size of pictures and film (1280x720)");
  declare_look(command, options.look);
  declare_colouring(command, options.stage.colouring);
  command.add_flag("--contacts", options.stage.contacts, "Draw contact points and normals");
  command.add_flag("--joints", options.stage.joints, "Draw joints: arms, anchors and reactions");
  command.add_option("--gpu", options.gpu, "What draws: auto, software, or the number of a GPU (auto)")
      ->type_name("GPU");
  command.add_option("--samples", options.stage.enlargement, "Draw this many times as large, for smoother stills (1)")
      ->type_name("N")
      ->check(whole_number(1, 4));
  declare_degrees(command, "--azimuth", options.stage.azimuth, "Direction of the eye about z, from +x (-55)");
  declare_degrees(command, "--elevation", options.stage.elevation, "Direction of the eye above the horizon (24)");
  declare_degrees(command, "--turn", options.stage.turn, "Turn of the camera per simulated second (0)");
  command.add_option("--zoom", options.stage.zoom, "Zoom in by this factor (1)")
      ->type_name("X")
      ->check(number_between(0.05, 50))
      ->group("Camera");
  command.add_flag("--quiet", options.run.quiet, "No progress bar, no names of files")->group("Output");
  command.footer(
      "Examples:\n"
      "  fathom render pyramid --layers 15 --at 0,5,10s --size 1280x720 -o shots/\n"
      "  fathom render layers --bodies 5000 --video layers.mp4 --seconds 8 --turn 10\n"
      "  fathom run pyramid --record run.rec && fathom render run.rec --video run.mp4\n"
      "  fathom render drift --bodies 500 --web drift.html --seconds 10\n"
      "\n"
      "Exit code: 0 all was written; 2 the command line, a scene or a file is wrong, or nothing here can draw;\n"
      "130 Ctrl-C, what was drawn is written.");
}

}  // namespace fathom::cli
