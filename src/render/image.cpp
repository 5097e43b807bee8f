#include "render/image.hpp"

#include <png.h>

#include <algorithm>
#include <cstdlib>
#include <fathom/error.hpp>

#include "files/output_file.hpp"

namespace fathom::render {

void write_png(const Image& image, const std::string& path) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGB;
  png_alloc_size_t size = 0;
  std::vector<std::uint8_t> bytes;
  const auto encode = [&](void* to) {
    if (png_image_write_to_memory(&png, to, &size, 0, image.pixels.data(), 0, nullptr) == 0)
      throw Error(ErrorCode::capacity, path + ": no PNG can be made of the picture (" + png.message + ")");
  };
  encode(nullptr);  // determines the size
  bytes.resize(size);
  encode(bytes.data());
  files::write_file(path, {reinterpret_cast<const char*>(bytes.data()), size});
}

Image read_png(const std::string& path) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&png, path.c_str()) == 0) {
    throw Error(ErrorCode::file, path + ": cannot be read as PNG (" + png.message + ")");
  }
  png.format = PNG_FORMAT_RGB;
  Image image{static_cast<int>(png.width), static_cast<int>(png.height), {}};
  image.pixels.resize(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr) == 0) {
    throw Error(ErrorCode::file, path + ": cannot be read to its end (" + png.message + ")");
  }
  return image;
}

ImageDifference difference(const Image& a, const Image& b, int limit) {
  if (a.width != b.width || a.height != b.height) {
    throw Error(ErrorCode::invalid_argument, "pictures of different sizes cannot be compared");
  }
  double sum = 0, beyond = 0;
  for (std::size_t i = 0; i < a.pixels.size(); i += 3) {
    int most = 0;
    for (std::size_t channel = i; channel < i + 3; ++channel) {
      const int apart = std::abs(a.pixels[channel] - b.pixels[channel]);
      sum += apart;
      most = std::max(most, apart);
    }
    beyond += most > limit;
  }
  const auto channels = static_cast<double>(a.pixels.size());
  return {sum / channels, 3 * beyond / channels};
}

}  // namespace fathom::render
