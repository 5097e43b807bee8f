// Colours of bodies.
#pragma once

#include <cstdint>

namespace fathom::render {

/// sRGB.
struct Colour {
  std::uint8_t r = 0, g = 0, b = 0, a = 255;

  friend bool operator==(Colour, Colour) = default;
};

/// One of a few colours that go well together; neighbouring indices differ.
Colour palette(std::uint64_t index);
/// The same colours, scattered, for bodies in no particular order.
Colour scattered(std::uint64_t index);
/// From blue through green and yellow to red, 0 ≤ share ≤ 1 (Turbo; Mikhailov 2019, its polynomial form).
Colour turbo(float share);
/// From violet through red and orange to sand, 0 ≤ share ≤ 1: heights of a pile.
Colour sunset(float share);

}  // namespace fathom::render
