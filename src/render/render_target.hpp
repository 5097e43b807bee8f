// Framebuffers to draw into.
#pragma once

#include "render/gl_objects.hpp"
#include "render/image.hpp"

namespace fathom::render {

/// A framebuffer with several samples per pixel, drawn `enlargement` times as large in both directions and averaged
/// when read.
class OffscreenTarget {
 public:
  /// Throws `Error{invalid_argument}` if the size exceeds what the GPU can draw.
  OffscreenTarget(int width, int height, int samples = 4, int enlargement = 1);

  GLuint framebuffer() const { return multisampled_.framebuffer.get(); }
  /// Size to draw at (pixels).
  int width() const { return enlargement_ * width_; }
  int height() const { return enlargement_ * height_; }
  /// Waits for the drawing and reads the picture.
  void read(Image& image);
  /// Copies the picture into the window, `x` pixels from its left.
  void copy_to_window(int x = 0);

 private:
  struct Surface {
    GlFramebuffer framebuffer;
    GlRenderbuffer colour, depth;
  };
  void resolve();
  static Surface make_surface(int width, int height, int samples, bool with_depth);

  int width_, height_, enlargement_;
  Surface multisampled_, resolved_;
  std::vector<std::uint8_t> rows_;
};

/// Reads the window's content into a picture of its size.
void read_window(Image& image);

}  // namespace fathom::render
