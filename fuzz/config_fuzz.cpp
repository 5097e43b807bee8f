// Any text as an engine configuration, or as single keys from the command line: refused with one `Error`, or read; the
// values read are written as text that reads back the same.
#include <string>
#include <string_view>

#include "engine/config.hpp"
#include "input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace fathom;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  engine::Config config;
  try {
    if (text.starts_with('=')) {
      for (std::size_t from = 1; from < size;) {
        const std::size_t end = std::min(text.find('\n', from), size);
        config.set(text.substr(from, end - from));
        from = end + 1;
      }
    } else {
      config.parse(text, "fuzz.toml");
    }
  } catch (const Error&) {
    return 0;
  }
  engine::Config again;
  again.parse(config.text(false), "again.toml");
  fuzz::require(again.text(false) == config.text(false));
  return 0;
}
