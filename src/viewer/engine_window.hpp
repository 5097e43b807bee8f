// A window for the engine: draws its entities and delivers events to it.
#pragma once

#include <memory>

#include "engine/front_end.hpp"

namespace fathom::viewer {

struct EngineWindowSettings {
  std::string title = "Fathom";
  int width = 1280, height = 720;
  bool wait_for_display = true;  ///< at most one frame per display refresh
};

class EngineWindow final : public engine::FrontEnd {
 public:
  /// Throws `Error{unavailable}` without a display or OpenGL 4.5.
  explicit EngineWindow(const EngineWindowSettings& settings = {});
  ~EngineWindow() override;

  void poll(std::vector<engine::InputEvent>& events) override;
  void draw(const engine::DrawFrame& frame) override;
  bool has_vsync() const override;
  void set_title(std::string_view title) override;
  /// Writes the window's content as PNG. Throws `Error{file}`.
  void save(const std::string& path) const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace fathom::viewer
