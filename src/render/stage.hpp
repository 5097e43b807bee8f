// Camera, look and shadows for a moving world: pictures of an unattended run.
#pragma once

#include <fathom/world.hpp>
#include <string>

#include "render/image.hpp"
#include "render/render_target.hpp"
#include "render/renderer.hpp"
#include "render/world_picture.hpp"

namespace fathom::render {

struct StageSettings {
  int width = 1280, height = 720;
  int samples = 4;      ///< per pixel
  int enlargement = 1;  ///< drawn this many times as large, averaged when read
  LookKind look = LookKind::daylight;
  Colouring colouring = Colouring::start;
  float azimuth = -0.96f;   ///< rad, the eye's direction about z from +x
  float elevation = 0.42f;  ///< rad above the horizon
  float zoom = 1;           ///< > 1: nearer
  float turn = 0;           ///< rad/s of simulated time about z
  bool contacts = false;    ///< draw contact points, normals and impulses
  bool joints = false;      ///< draw joints and their reactions
  RendererSettings renderer{};
};

/// Draws into memory. An OpenGL context must be current throughout its life.
class Stage {
 public:
  explicit Stage(const StageSettings& settings);

  /// A picture of the world's current state. The camera shows everything that moves; if that has grown since the last
  /// picture, it moves back: at once if `smooth` is false, otherwise over about a second of pictures.
  const Image& draw(const World& world, bool smooth = false);

 private:
  Aabb framed(const World& world, bool smooth);

  StageSettings settings_;
  Renderer renderer_;
  OffscreenTarget target_;
  WorldPicture picture_;
  Image image_;
  std::optional<Aabb> box_;
  double last_time_ = 0;
  std::vector<Mark> marks_, sensor_marks_;
};

/// Marks for contact points (by impulse) and normals.
void add_contact_marks(const World& world, std::vector<Mark>& marks);

}  // namespace fathom::render
