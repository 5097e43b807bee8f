#include "render/render_target.hpp"

#include <algorithm>
#include <fathom/error.hpp>
#include <string>

namespace fathom::render {

OffscreenTarget::Surface OffscreenTarget::make_surface(int width, int height, int samples, bool with_depth) {
  Surface s{make_framebuffer(), make_renderbuffer(), {}};
  glNamedRenderbufferStorageMultisample(s.colour.get(), samples, GL_RGBA8, width, height);
  glNamedFramebufferRenderbuffer(s.framebuffer.get(), GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, s.colour.get());
  if (with_depth) {
    s.depth = make_renderbuffer();
    glNamedRenderbufferStorageMultisample(s.depth.get(), samples, GL_DEPTH_COMPONENT32F, width, height);
    glNamedFramebufferRenderbuffer(s.framebuffer.get(), GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, s.depth.get());
  }
  if (glCheckNamedFramebufferStatus(s.framebuffer.get(), GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw Error(ErrorCode::unavailable, "the GPU cannot draw pictures of this size; ask for a smaller --size");
  }
  return s;
}

OffscreenTarget::OffscreenTarget(int width, int height, int samples, int enlargement)
    : width_(width), height_(height), enlargement_(enlargement) {
  GLint largest = 0, max_samples = 0;
  glGetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &largest);
  glGetIntegerv(GL_MAX_SAMPLES, &max_samples);
  if (std::max(this->width(), this->height()) > largest) {
    throw Error(ErrorCode::invalid_argument, "a picture of " + std::to_string(width) + "x" + std::to_string(height) +
                                                 " is too large; this GPU draws up to " +
                                                 std::to_string(largest / enlargement) + " pixels");
  }
  multisampled_ = make_surface(this->width(), this->height(), std::min<int>(samples, max_samples), true);
  resolved_ = make_surface(this->width(), this->height(), 0, false);
}

void OffscreenTarget::resolve() {
  glBlitNamedFramebuffer(multisampled_.framebuffer.get(), resolved_.framebuffer.get(), 0, 0, width(), height(), 0, 0,
                         width(), height(), GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

void OffscreenTarget::copy_to_window(int x) {
  resolve();
  glBlitNamedFramebuffer(resolved_.framebuffer.get(), 0, 0, 0, width(), height(), x, 0, x + width_, height_,
                         GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

void OffscreenTarget::read(Image& image) {
  resolve();
  rows_.resize(static_cast<std::size_t>(width()) * height() * 3);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, resolved_.framebuffer.get());
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width(), height(), GL_RGB, GL_UNSIGNED_BYTE, rows_.data());
  image.width = width_;
  image.height = height_;
  image.pixels.resize(static_cast<std::size_t>(width_) * height_ * 3);
  const int e = enlargement_;
  const std::size_t stride = static_cast<std::size_t>(width()) * 3;
  for (int y = 0; y < height_; ++y) {
    // OpenGL's rows start at the bottom.
    const std::uint8_t* source = rows_.data() + stride * static_cast<std::size_t>(e * (height_ - 1 - y));
    std::uint8_t* target = image.row(y);
    if (e == 1) {
      std::copy_n(source, stride, target);
      continue;
    }
    for (int i = 0; i < 3 * width_; ++i) {
      const std::uint8_t* corner = source + 3 * e * (i / 3) + i % 3;
      int sum = e * e / 2;
      for (int v = 0; v < e; ++v)
        for (int u = 0; u < e; ++u)
          sum += corner[stride * static_cast<std::size_t>(v) + 3 * static_cast<std::size_t>(u)];
      target[i] = static_cast<std::uint8_t>(sum / (e * e));
    }
  }
}

void read_window(Image& image) {
  image.pixels.resize(static_cast<std::size_t>(image.width) * image.height * 3);
  glBindFramebuffer(GL_READ_FRAMEBUFFER, 0);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, image.width, image.height, GL_RGB, GL_UNSIGNED_BYTE, image.pixels.data());
  for (int y = 0; y < image.height / 2; ++y) {
    std::swap_ranges(image.row(y), image.row(y) + 3 * image.width, image.row(image.height - 1 - y));
  }
}

}  // namespace fathom::render
