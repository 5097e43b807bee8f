// `fathom save-shape`: a body's shape from a scene file, written so that programs and scenes load it without building
// it.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fathom/mesh.hpp>
#include <fathom/saved_shape.hpp>

#include "commands.hpp"
#include "files/output_file.hpp"
#include "scene/scene_file.hpp"
#include "scene/suggest.hpp"

namespace fathom::cli {

void declare_save_shape(CLI::App& command, SaveShapeOptions& options) {
  command.add_option("scene", options.scene, "A scene file")->required()->type_name("SCENE.toml");
  command.add_option("body", options.body, "The name of the body whose shape is saved")->required()->type_name("BODY");
  command.add_option("-o,--output", options.output, "Where to")->required()->type_name("FILE");
  command.footer(
      "Use: shape = {type = \"saved\", file = \"FILE\"} in a scene, fathom::load_shape in a program.\n"
      "Example:\n  fathom save-shape examples/scenes/surfaces.toml hillside -o hillside.shape");
}

int save_shape(const SaveShapeOptions& options) {
  const Scene scene = load_scene(options.scene);
  const auto found = std::ranges::find(scene.names, options.body, &NamedBody::name);
  if (found == scene.names.end()) {
    std::vector<std::string_view> known;
    for (const NamedBody& named : scene.names) {
      // Of repeated bodies, which are alike, the first.
      const std::size_t dot = named.name.rfind('.');
      if (dot == named.name.npos || named.name.substr(dot) == ".0") known.push_back(named.name);
    }
    throw Error(ErrorCode::file, options.scene + ": there is no body named '" + options.body + "'" +
                                     (known.empty() ? "; give it a name" : suggestion(options.body, known)));
  }
  const Shape& shape = scene.bodies[found->body].shape;
  std::vector<std::byte> bytes;
  fathom::save_shape(shape, bytes);
  files::OutputFile file(options.output);
  file.write(bytes.data(), bytes.size());
  file.finish();
  const std::string triangles =
      shape.is_surface() ? fmt::format(", {} triangles", shape.surface->triangle_count()) : std::string();
  fmt::print("{}: the shape of '{}'{}, {} bytes\n", options.output, options.body, triangles, bytes.size());
  return finished;
}

}  // namespace fathom::cli
