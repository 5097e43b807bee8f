#include "render/colour.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace fathom::render {
namespace {

constexpr std::array<Colour, 8> colours{{{224, 92, 80},
                                         {240, 168, 56},
                                         {42, 150, 140},
                                         {62, 124, 190},
                                         {236, 206, 120},
                                         {126, 104, 176},
                                         {128, 176, 96},
                                         {214, 128, 160}}};

constexpr std::array<Colour, 6> sunset_colours{
    {{74, 62, 128}, {146, 72, 140}, {214, 86, 104}, {238, 128, 74}, {244, 178, 84}, {246, 222, 150}}};

std::uint8_t byte(float share) { return static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0f, 1.0f))); }

std::uint8_t between(std::uint8_t a, std::uint8_t b, float share) {
  return byte(((1 - share) * static_cast<float>(a) + share * static_cast<float>(b)) / 255);
}

}  // namespace

Colour palette(std::uint64_t index) { return colours[index % colours.size()]; }

Colour scattered(std::uint64_t index) {
  // Multiples of the golden ratio, spread over 64 bits.
  return palette((index * 0x9E3779B97F4A7C15u) >> 40);
}

Colour turbo(float share) {
  const float x = std::clamp(share, 0.0f, 1.0f);
  const auto polynomial = [x](float a, float b, float c, float d, float e, float f) {
    return byte(a + x * (b + x * (c + x * (d + x * (e + x * f)))));
  };
  return {polynomial(0.13572138f, 4.61539260f, -42.66032258f, 132.13108234f, -152.94239396f, 59.28637943f),
          polynomial(0.09140261f, 2.19418839f, 4.84296658f, -14.18503333f, 4.27729857f, 2.82956604f),
          polynomial(0.10667330f, 12.64194608f, -60.58204836f, 110.36276771f, -89.90310912f, 27.34824973f)};
}

Colour sunset(float share) {
  const float x = std::clamp(share, 0.0f, 1.0f) * static_cast<float>(sunset_colours.size() - 1);
  const auto i = std::min(static_cast<std::size_t>(x), sunset_colours.size() - 2);
  const float rest = x - static_cast<float>(i);
  const Colour a = sunset_colours[i], b = sunset_colours[i + 1];
  return {between(a.r, b.r, rest), between(a.g, b.g, rest), between(a.b, b.b, rest)};
}

}  // namespace fathom::render
