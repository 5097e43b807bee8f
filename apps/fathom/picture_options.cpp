#include "picture_options.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>

#include "validators.hpp"

namespace fathom::cli {

void declare_picture_size(CLI::App& command, int& width, int& height, const std::string& help) {
  const auto parse = [](const std::string& text) -> std::optional<std::pair<int, int>> {
    int w = 0, h = 0;
    char more = 0;
    const bool good =
        std::sscanf(text.c_str(), "%5dx%5d%c", &w, &h, &more) == 2 && w >= 16 && h >= 16 && w <= 16384 && h <= 16384;
    return good ? std::optional(std::pair(w, h)) : std::nullopt;
  };
  command
      .add_option_function<std::string>(
          "--size", [&width, &height, parse](const std::string& text) { std::tie(width, height) = *parse(text); }, help)
      ->type_name("WxH")
      ->check(CLI::Validator(
          [parse](std::string& text) -> std::string {
            return parse(text) ? std::string() : "must be WIDTHxHEIGHT from 16x16 to 16384x16384, not " + text;
          },
          ""));
}

void declare_look(CLI::App& command, std::optional<render::LookKind>& look) {
  declare_choice<render::LookKind>(command, "--look", look,
                                   {{"daylight", render::LookKind::daylight}, {"water", render::LookKind::water}},
                                   "Light and air (water where there is no gravity)");
}

void declare_colouring(CLI::App& command, render::Colouring& colouring) {
  declare_choice<render::Colouring>(
      command, "--colour", colouring,
      {{"start", render::Colouring::start}, {"speed", render::Colouring::speed}, {"island", render::Colouring::island}},
      "What colours show: the height a body started at, its speed, its island (start)");
}

}  // namespace fathom::cli
