// A self-contained page that plays a run in any browser with WebGL 2.
//
// Positions are rounded to 1/500 of the smallest body, quaternions to 1/2000 per component. Each frame stores, by
// channel (x, y, z, then w, x, y, z), every body's difference from the linear extrapolation of its last two frames as a
// zigzag variable-length integer. After zlib's compression, bodies at rest cost next to nothing.
#pragma once

#include <cstdint>
#include <fathom/world.hpp>
#include <string>
#include <vector>

#include "render/camera.hpp"
#include "render/look.hpp"
#include "render/world_picture.hpp"

namespace fathom::render {

class WebPage {
 public:
  /// `rate`: frames per simulated second.
  WebPage(std::string name, double rate) : name_(std::move(name)), rate_(rate) {}

  /// Adds a frame. Bodies may be added and removed between frames; a removed body must not return.
  void add(const World& world);
  /// The page. `azimuth` and `elevation` are those of the initial view (rad).
  std::string html(bool under_water, float azimuth, float elevation) const;
  std::size_t frames() const { return known_.size(); }

 private:
  static constexpr int channels = 7;
  struct Entry {
    BodyId id;
    std::size_t first = 0, last = 0;  // frames in which it exists
    Shape shape;
    Colour colour;
    bool ground = false, dynamic = false;
    std::int32_t before[channels] = {}, before_that[channels] = {};
  };

  void enter_new_bodies(const World& world);
  void append_number(std::int32_t value);

  std::string name_;
  double rate_;
  std::vector<Entry> entries_;
  std::vector<std::size_t> entry_of_slot_;
  std::vector<std::size_t> known_;  // number of entries by frame
  std::vector<std::uint8_t> stream_;
  float quantum_ = 0;  // m
  Aabb view_{};        // of everything that moves, in all frames
  WorldColours colours_;
};

}  // namespace fathom::render
