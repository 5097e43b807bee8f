#include "viewer/preferences.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <type_traits>

#include "files/output_file.hpp"

namespace fathom::viewer {
namespace {

/// Calls `visit(name, value, least, most)` for every stored preference, as numbers.
template <class P, class Visit>
void for_each(P& p, Visit visit) {
  visit("width", p.width, 320, 16384);
  visit("height", p.height, 200, 16384);
  visit("speed", p.speed, 0.05, 4);
  visit("show_panel", p.show_panel, 0, 1);
  visit("boxes", p.overlays.boxes, 0, 1);
  visit("points", p.overlays.points, 0, 1);
  visit("normals", p.overlays.normals, 0, 1);
  visit("impulses", p.overlays.impulses, 0, 1);
  visit("graph", p.overlays.graph, 0, 1);
  visit("joints", p.overlays.joints, 0, 1);
  visit("reactions", p.overlays.reactions, 0, 1);
  visit("see_through", p.overlays.see_through, 0, 1);
  visit("colouring", p.colouring, 0, static_cast<double>(render::Colouring::island));
  int look = p.look ? static_cast<int>(*p.look) : -1;
  visit("look", look, -1, static_cast<double>(render::LookKind::water));
  if constexpr (!std::is_const_v<P>) {
    p.look.reset();
    if (look >= 0) p.look = static_cast<render::LookKind>(look);
  }
}

}  // namespace

std::string preferences_file() {
  const char* folder = std::getenv("XDG_CONFIG_HOME");
  if (folder && *folder) return std::string(folder) + "/fathom/viewer.toml";
  const char* home = std::getenv("HOME");
  return home && *home ? std::string(home) + "/.config/fathom/viewer.toml" : std::string();
}

Preferences load_preferences(const std::string& path) {
  Preferences preferences;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string name, equals;
    double number = 0;
    if (!(words >> name >> equals >> number) || equals != "=") continue;
    for_each(preferences, [&](const char* known, auto& value, double least, double most) {
      if (name == known && number >= least && number <= most)
        value = static_cast<std::remove_reference_t<decltype(value)>>(number);
    });
  }
  return preferences;
}

void save_preferences(const std::string& path, const Preferences& preferences) {
  std::string text = "# What 'fathom view' remembers; it writes this file when its window is closed.\n";
  for_each(preferences, [&](const char* name, const auto& value, double, double) {
    text += fmt::format("{} = {:g}\n", name, static_cast<double>(value));
  });
  std::error_code ignored;  // errors with the folder are reported when the file is opened
  std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
  files::OutputFile file(path);
  file.write(text);
  file.finish();
}

}  // namespace fathom::viewer
