#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "page/html.hpp"
#include "sections.hpp"

namespace fathom::campaign {
namespace {

std::string base64(const std::string& bytes) {
  constexpr const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? digits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

}  // namespace

std::string pictures_section(const View& view, const Store& store) {
  const std::vector<Picture>& pictures = view.campaign().pictures;
  std::string html = "<h2 id='pictures'>Pictures</h2>\n";
  if (pictures.empty())
    return html + "<p>None: this build or machine cannot draw, or the runs that are drawn were left out.</p>\n";
  html += "<p>About 1,000 bodies (the pyramid: 385) at the start, in the middle and at the end of measured runs.</p>\n";
  std::string group;
  for (const Picture& p : pictures) {
    const std::string title = p.environment + ": " + p.label;
    if (group != title) {
      if (!group.empty()) html += "</div>\n";
      html += fmt::format("<h3>{}</h3>\n<div class='pictures'>\n", page::escaped(title));
      group = title;
    }
    html += fmt::format(
        "<figure><img alt='{0}, {1}' src='data:image/png;base64,{2}'><figcaption>{1}</figcaption></figure>\n",
        page::escaped(title), p.moment, base64(store.read(p.file)));
  }
  return html + "</div>\n";
}

}  // namespace fathom::campaign
