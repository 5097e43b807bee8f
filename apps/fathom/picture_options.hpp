// Options shared by `fathom render` and `fathom view`.
#pragma once

#include <optional>
#include <string>

#include "render/stage.hpp"

namespace CLI {
class App;
}

namespace fathom::cli {

void declare_picture_size(CLI::App& command, int& width, int& height, const std::string& help);
void declare_look(CLI::App& command, std::optional<render::LookKind>& look);
void declare_colouring(CLI::App& command, render::Colouring& colouring);

}  // namespace fathom::cli
