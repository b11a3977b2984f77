// Building the page, block by block.
#include "host/report/html.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "host/error.hpp"
#include "host/io/exposure.hpp"
#include "host/io/files.hpp"
#include "host/io/image.hpp"
#include "host/math/statistics.hpp"
#include "host/report/html_page.hpp"
#include "host/report/sha256.hpp"
#include "host/report/shared_text.hpp"

namespace clerestory {
namespace {

constexpr int kSmall = 256;  // pictures narrower than this are enlarged without smoothing: one sees their pixels

std::string escaped(std::string_view text) {
  std::string out;
  for (char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string data_url(const std::string& png) { return "data:image/png;base64," + base64(png); }

std::string figcaption(const std::string& text) {
  return text.empty() ? "" : "<figcaption>" + escaped(text) + "</figcaption>";
}

/// Width and height from a PNG's header chunk (W3C PNG, 11.2.2).
std::pair<int, int> png_size(const std::string& png, const std::string& where) {
  static constexpr std::string_view signature("\x89PNG\r\n\x1a\n", 8);
  if (png.size() < 24 || !png.starts_with(signature)) throw usage_error("not a PNG", where);
  const auto number = [&](std::size_t at) {
    unsigned value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<unsigned char>(png[at + i]);
    return static_cast<int>(value);
  };
  return {number(16), number(20)};
}

float brightest(const Image& image) { return *std::ranges::max_element(image.data); }

/// Exposures to store, in steps of 3 EV: 0, and darker ones while something is still clipped in the one before.
std::vector<int> stored_exposures(const Image& image, double exposure) {
  std::vector<int> levels{0};
  while (levels.back() > -12 && exposure * brightest(image) * std::exp2(levels.back()) > 1)
    levels.push_back(levels.back() - 3);
  return levels;
}

std::string compare_side(const char* kind, const std::string& title, const Image& image, double exposure) {
  std::string html = fmt::format("<div class=\"side {}\">", kind);
  for (int ev : stored_exposures(image, exposure)) {
    const std::string png = encode_png(show_radiance(image, exposure * std::exp2(ev)), Encoding::Linear, title);
    html += fmt::format("<img data-ev=\"{}\"{} alt=\"{}\" src=\"{}\">", ev, ev == 0 ? " class=\"shown\"" : "",
                        escaped(title), data_url(png));
  }
  return html + "</div>";
}

/// A ramp of the bar's colours and its marks below.
std::string bar_html(const ColourBar& bar) {
  std::string stops, marks;
  for (const auto& c : bar.colours)
    stops += fmt::format(",rgb({:.0f},{:.0f},{:.0f})", 255 * c[0], 255 * c[1], 255 * c[2]);
  for (const std::string& text : bar.marks) marks += "<span>" + escaped(text) + "</span>";
  return "<div class=\"bar-of-colours\"><div style=\"background:linear-gradient(to right" + stops + ")\"></div><p>" +
         marks + "</p></div>";
}

std::string columns_html(const std::vector<std::string>& columns) {
  std::string html = "<p class=\"columns\">";
  for (const std::string& text : columns) html += "<span>" + escaped(text) + "</span>";
  return html + "</p>";
}

std::string picture_html(const Picture& picture) {
  const auto [width, height] = png_size(picture.png, picture.title);
  std::string html =
      fmt::format("<figure{}><img{} width=\"{}\" height=\"{}\" style=\"height:auto\" alt=\"{}\" src=\"{}\">",
                  width > 2 * height ? " class=\"row\"" : "", width < kSmall ? " class=\"small\"" : "", width, height,
                  escaped(picture.title), data_url(picture.png));
  if (!picture.columns.empty()) html += columns_html(picture.columns);
  if (picture.bar) html += bar_html(*picture.bar);
  html += "<figcaption><b>" + escaped(picture.title) + "</b>";
  if (!picture.note.empty()) html += "<span>" + escaped(picture.note) + "</span>";
  return html + "</figcaption></figure>";
}

std::string command_html(const std::string& text) {
  return "<div class=\"command\"><pre>" + escaped(text) + "</pre><button type=\"button\">Copy</button></div>\n";
}

std::string cell_html(const Table& table, std::size_t row, std::size_t column) {
  const Cell& cell = table.rows[row][column];
  std::string text = escaped(cell_text(cell, table.columns[column]));
  if (const auto at = text.find(" \u00b1"); std::holds_alternative<Measure>(cell) && at != std::string::npos)
    text = text.substr(0, at) + "<span class=\"deviation\">" + text.substr(at) + "</span>";
  return is_best(table, row, column) ? "<strong>" + text + "</strong>" : text;
}

std::string table_html(const Table& table) {
  std::vector<const char*> alignment;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const bool numeric =
        std::ranges::any_of(table.rows, [&](const auto& row) { return std::holds_alternative<Measure>(row[c]); });
    alignment.push_back(numeric ? " class=\"number\"" : "");
  }
  std::string html = "<table><thead><tr>";
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    const Column& column = table.columns[c];
    const std::string unit = column.unit.empty() ? "" : "<small>" + escaped(column.unit) + "</small>";
    html += fmt::format("<th{}>{}{}</th>", alignment[c], escaped(column.name), unit);
  }
  html += "</tr></thead><tbody>";
  for (std::size_t r = 0; r < table.rows.size(); ++r) {
    html += "<tr>";
    for (std::size_t c = 0; c < table.columns.size(); ++c)
      html += fmt::format("<td{}>{}</td>", alignment[c], cell_html(table, r, c));
    html += "</tr>";
  }
  return html + "</tbody></table>";
}

/// The element alone: the XML prolog does not belong into HTML, and ids must not repeat from plot to plot.
std::string inline_svg(std::string svg, int number) {
  svg.erase(0, svg.find("<svg"));
  for (const std::string id : {"gnuplot_canvas", "gnuplot_plot_", "gpDot", "gpPt", "textbox", "greybox"}) {
    for (const std::string before : {"id=\"", "id='", "href='#", "href=\"#", "url(#"}) {
      const std::string from = before + id, to = before + fmt::format("p{}", number) + id;
      for (std::size_t at = 0; (at = svg.find(from, at)) != std::string::npos; at += to.size())
        svg.replace(at, from.size(), to);
    }
  }
  return svg;
}

std::string plot_figure(const std::string& drawing, const std::string& caption) {
  return "<figure class=\"plot\">" + drawing + figcaption(caption) + "</figure>\n";
}

/// What a browser may do on behalf of the page: apply its own style, run its own script, show pictures that stand in
/// it. Whatever else a name or a file may have brought in stays dead, and nothing asks the network (Content Security
/// Policy Level 3, W3C). Attributes called style are the page's own layout.
std::string policy() {
  const auto hash = [](std::string_view text) { return "'sha256-" + base64(sha256(text)) + "'"; };
  return "default-src 'none'; img-src data:; style-src-elem " + hash(kPageStyle) +
         "; style-src-attr 'unsafe-inline'; script-src " + hash(kPageScript) + "; base-uri 'none'; form-action 'none'";
}

std::string description(const std::string& term, const std::string& text) {
  return text.empty() ? "" : "<dt>" + escaped(term) + "</dt><dd>" + escaped(text) + "</dd>";
}

}  // namespace

Picture picture_of(std::string title, const Image& display, std::string note, std::optional<ColourBar> bar) {
  std::string png = encode_png(display, Encoding::Linear, title);
  return {std::move(title), std::move(png), std::move(note), std::move(bar), {}};
}

Picture picture_file(std::string title, const std::filesystem::path& path, std::string note) {
  std::string png = read_file(path, std::uint64_t{64} << 20);
  png_size(png, path.string());
  return {std::move(title), std::move(png), std::move(note), {}, {}};
}

HtmlReport::HtmlReport(std::string title, std::string subtitle)
    : title_(std::move(title)), subtitle_(std::move(subtitle)) {}

HtmlReport& HtmlReport::section(const std::string& title, const std::string& text) {
  sections_.push_back(title);
  body_ += fmt::format("<h2 id=\"s{}\">{}</h2>\n", sections_.size(), escaped(title));
  return text.empty() ? *this : paragraph(text);
}

HtmlReport& HtmlReport::paragraph(const std::string& text) {
  body_ += "<p>" + escaped(text) + "</p>\n";
  return *this;
}

HtmlReport& HtmlReport::facts(const std::vector<std::pair<std::string, std::string>>& facts) {
  body_ += "<dl class=\"facts\">";
  for (const auto& [name, value] : facts)
    body_ += "<div><dt>" + escaped(name) + "</dt><dd>" + escaped(value) + "</dd></div>";
  body_ += "</dl>\n";
  return *this;
}

HtmlReport& HtmlReport::notes(const std::vector<std::pair<std::string, std::string>>& notes) {
  body_ += "<dl class=\"notes\">";
  for (const auto& [name, text] : notes) body_ += description(name, text);
  body_ += "</dl>\n";
  return *this;
}

HtmlReport& HtmlReport::pictures(const std::vector<Picture>& pictures, const std::string& caption) {
  body_ += "<figure><div class=\"grid\">";
  for (const Picture& picture : pictures) body_ += picture_html(picture);
  body_ += "</div>" + figcaption(caption) + "</figure>\n";
  return *this;
}

HtmlReport& HtmlReport::compare(const std::string& before_title, const Image& before, const std::string& after_title,
                                const Image& after, const std::string& caption, int bar) {
  if (before.width != after.width || before.height != after.height || before.channels != 3 || after.channels != 3)
    throw Error(ErrorKind::Failed, "two pictures to compare must be of one size, with 3 channels",
                before_title + " and " + after_title);
  const double exposure = shown_exposure(before);
  const int darkest =
      std::min({-4, stored_exposures(before, exposure).back(), stored_exposures(after, exposure).back()});
  const std::string note = exposure == 1 ? "" : fmt::format(" At 0 EV the radiance is multiplied by {:.3g}.", exposure);
  // Never wider than looks right for the picture's height on a screen.
  const std::string width =
      fmt::format("max-width:min(100%,calc(86vh*{:.4f}))", static_cast<double>(before.width) / before.height);
  body_ += fmt::format("<figure class=\"compare\"><div class=\"stage\" style=\"aspect-ratio:{}/{};{};--at:{}%\">",
                       before.width, before.height, width, bar);
  body_ += compare_side("second", after_title, after, exposure) + compare_side("first", before_title, before, exposure);
  body_ += fmt::format(
      "<span class=\"tag left\">{0}</span><span class=\"tag right\">{1}</span>"
      "<input class=\"wipe\" type=\"range\" min=\"0\" max=\"100\" step=\"0.1\" value=\"{2}\" aria-label=\"{0} or "
      "{1}\"><div class=\"bar\"></div></div>",
      escaped(before_title), escaped(after_title), bar);
  body_ += fmt::format(
      "<div class=\"controls\" style=\"{}\"><label>Exposure <input class=\"exposure\" type=\"range\" min=\"{}\" "
      "max=\"6\" "
      "step=\"0.1\" value=\"0\"><output>0.0 EV</output></label>"
      "<label><input class=\"minus\" type=\"checkbox\"> Difference</label>"
      "<button class=\"reset\" type=\"button\">Reset</button></div>",
      width, darkest);
  body_ += figcaption(caption + note) + "</figure>\n";
  return *this;
}

HtmlReport& HtmlReport::table(const Table& table, const std::string& caption) {
  std::string title = table.title.empty() ? "" : "<b>" + escaped(table.title) + ".</b> ";
  if (!table.note.empty()) title += escaped(table.note) + " ";
  body_ += "<figure><div class=\"wide\">" + table_html(table) + "</div>";
  if (!title.empty() || !caption.empty()) body_ += "<figcaption>" + title + escaped(caption) + "</figcaption>";
  body_ += "</figure>\n";
  return *this;
}

HtmlReport& HtmlReport::plot(const Plot& plot, const std::string& caption) {
  if (!can_plot()) return paragraph(left_out_plot(plot));
  body_ += plot_figure(inline_svg(plot_svg(plot), ++plots_), caption);
  return *this;
}

HtmlReport& HtmlReport::drawing(const std::string& svg, const std::string& caption) {
  if (svg.find("<svg") == std::string::npos) throw usage_error("not an SVG", "drawing", svg.substr(0, 40));
  body_ += plot_figure(
      fmt::format("<img alt=\"{}\" src=\"data:image/svg+xml;base64,{}\">", escaped(caption), base64(svg)), caption);
  return *this;
}

HtmlReport& HtmlReport::left_out(const std::vector<LeftOut>& list) {
  if (list.empty()) return *this;
  Table table{{}, {{"Left out", ""}, {"Why", ""}, {"Saved", ""}}, {}};
  for (const LeftOut& item : list) table.add({item.what, item.why, item.saved});
  body_ += "<details><summary>What was left out, and what that saved</summary><div class=\"wide\">" +
           table_html(table) + "</div></details>\n";
  return *this;
}

HtmlReport& HtmlReport::details(const std::string& title, const std::string& text) {
  body_ += "<details><summary>" + escaped(title) + "</summary><pre>" + escaped(text) + "</pre></details>\n";
  return *this;
}

HtmlReport& HtmlReport::command(const Provenance& p) {
  body_ += command_html(shared_command(p));
  return *this;
}

HtmlReport& HtmlReport::footer(const Provenance& p) {
  std::string seeds;
  for (const auto& [name, seed] : p.seeds) seeds += fmt::format("{}{} {}", seeds.empty() ? "" : ", ", name, seed);
  footer_ = "<dl>" + description("Device", p.device) + description("Computer", p.host + ", " + p.cpu) +
            description("Commit", p.build.commit + (p.build.dirty ? ", with local changes" : "")) +
            description("Build", p.build.version + ", " + p.build.type + ", " + p.build.compiler) +
            description("Seeds", seeds) + description("Time", p.started + (p.ended.empty() ? "" : " to " + p.ended)) +
            "</dl>";
  const bool whole = shared_command(p) == command_text(p.command);
  footer_ += fmt::format("<p>To repeat it{}:</p>", whole ? "" : ", with the paths that provenance.json has") +
             command_html(shared_command(p));
  return *this;
}

std::string HtmlReport::html() const {
  std::string page =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"" +
      policy() +
      "\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n";
  page += "<title>" + escaped(title_) + "</title>\n<style>" + kPageStyle + "</style></head>\n<body><main>\n";
  page += "<header><p class=\"house\">Clerestory</p><h1>" + escaped(title_) + "</h1>";
  if (!subtitle_.empty()) page += "<p class=\"subtitle\">" + escaped(subtitle_) + "</p>";
  page += "</header>\n";
  if (sections_.size() > 2) {
    page += "<nav>";
    for (std::size_t i = 0; i < sections_.size(); ++i)
      page += fmt::format("<a href=\"#s{}\">{}</a>", i + 1, escaped(sections_[i]));
    page += "</nav>\n";
  }
  page += body_ + "</main>\n<footer>" + footer_ + "</footer>\n";
  return page + "<dialog><img alt=\"\"><p></p></dialog>\n<script>" + kPageScript + "</script>\n</body></html>\n";
}

void HtmlReport::write(const std::filesystem::path& path) const { write_file(path, html()); }

}  // namespace clerestory
