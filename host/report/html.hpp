// A report in one file: no network, no other files; light and dark; prints. Its content security policy lets a browser
// run and apply only the page's own script and style.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/report/plot.hpp"
#include "host/report/preview.hpp"
#include "host/report/provenance.hpp"
#include "host/report/table.hpp"

namespace clerestory {

/// A picture as it goes into the page: PNG bytes and what it shows.
struct Picture {
  std::string title;  // a few words under the picture
  std::string png;
  std::string note;                       // range, unit; small; may be empty
  std::optional<ColourBar> bar;           // under the picture
  std::vector<std::string> columns = {};  // of pictures of one width, side by side in it: what each shows
};

/// Of display values (preview.hpp).
Picture picture_of(std::string title, const Image& display, std::string note = {}, std::optional<ColourBar> bar = {});
/// Of a PNG file. Throws ErrorKind::Usage.
Picture picture_file(std::string title, const std::filesystem::path& png, std::string note = {});

/// Built from top to bottom; every call adds one block. Text is plain text and is escaped.
class HtmlReport {
 public:
  explicit HtmlReport(std::string title, std::string subtitle = {});

  HtmlReport& section(const std::string& title, const std::string& text = {});
  HtmlReport& paragraph(const std::string& text);
  /// Name and value pairs: the figures one looks for first.
  HtmlReport& facts(const std::vector<std::pair<std::string, std::string>>& facts);
  /// Names and sentences, one below the other: what is said of a result at some length.
  HtmlReport& notes(const std::vector<std::pair<std::string, std::string>>& notes);
  /// Pictures side by side, as many in a row as the window allows, one more than twice as wide as it is high in a row
  /// of its own; click to enlarge.
  HtmlReport& pictures(const std::vector<Picture>& pictures, const std::string& caption = {});
  /// Two linear pictures of one size and unit (3 channels) under one slider, which stands at `bar` percent of the width
  /// at first, with exposure control and difference. Both are shown under shown_exposure() of the first. Exposure is
  /// exact: the pages hold several exposures, and for a 1/2.2 curve a gain is a gain of the shown values.
  HtmlReport& compare(const std::string& before_title, const Image& before, const std::string& after_title,
                      const Image& after, const std::string& caption = {}, int bar = 50);
  /// The best of each column that has a direction in bold, mean ± deviation.
  HtmlReport& table(const Table& table, const std::string& caption = {});
  /// Without gnuplot a sentence in its place.
  HtmlReport& plot(const Plot& plot, const std::string& caption = {});
  /// A plot drawn before: the text of an SVG file. It is shown as an image, in which no script runs and nothing is
  /// loaded, whoever made the file.
  HtmlReport& drawing(const std::string& svg, const std::string& caption = {});
  /// Folded: what was left out, why, and what that saved. Nothing when the list is empty.
  HtmlReport& left_out(const std::vector<LeftOut>& list);
  /// Folded text in a fixed-width face (a config, a log, the plan).
  HtmlReport& details(const std::string& title, const std::string& text);
  /// A command as one would type it again, to copy.
  HtmlReport& command(const Provenance& provenance);
  /// Device, commit and build, the command to repeat it; closes the page.
  HtmlReport& footer(const Provenance& provenance);

  std::string html() const;
  void write(const std::filesystem::path& path) const;

 private:
  std::string title_, subtitle_, body_, footer_;
  std::vector<std::string> sections_;
  int plots_ = 0;
};

}  // namespace clerestory
