//! What the diagram shows, from back to front: what the reference can't tell, the grid, the Pareto front, a guide of the observed
//! order, ladders with the spread of their times, words.

use plotters::prelude::{DrawingBackend, RGBColor};
use plotters::style::text_anchor::HPos;

use crate::chart::ChartError;
use crate::chart::axis::Axis;
use crate::chart::canvas::{At, Canvas, HEIGHT, Mark, WIDTH, Words, length};
use crate::chart::labels::{Page, Taken, about};
use crate::measurement::Metric;
use crate::setting::Knob;
use crate::statistics::{Order, Spread};
use crate::summary::{Clock, MeasuredLadder, Point, Summary};

const LEFT: f64 = 74.0;
const RIGHT: f64 = WIDTH as f64 - 22.0;
const TOP: f64 = 70.0;
const BOTTOM: f64 = HEIGHT as f64 - 54.0;

const INK: RGBColor = RGBColor(34, 34, 34);
const SOFT: RGBColor = RGBColor(95, 95, 95);
const FRONT: RGBColor = RGBColor(70, 70, 70);
const GRID: RGBColor = RGBColor(222, 222, 222);
const FAINT_GRID: RGBColor = RGBColor(241, 241, 241);
const UNKNOWN: RGBColor = RGBColor(238, 236, 230);

/// Okabe and Ito's colours (2008), which who sees fewer colours can tell apart; each with a mark of its own for print in grey.
fn look(knob: Knob) -> (RGBColor, Mark) {
    match knob {
        Knob::Spp => (RGBColor(0, 114, 178), Mark::Circle),
        Knob::Tolerance => (RGBColor(213, 94, 0), Mark::Square),
        Knob::Depth => (RGBColor(0, 158, 115), Mark::Diamond),
        Knob::MinWeight => (RGBColor(204, 121, 167), Mark::Up),
        Knob::Bvh => (RGBColor(230, 159, 0), Mark::Down),
        Knob::Shading => (RGBColor(86, 180, 233), Mark::Cross),
    }
}

/// A point that has both coordinates.
#[derive(Clone, Copy, Debug)]
struct Shown {
    index: usize,
    time: Spread,
    /// The limit, if the reference can't tell.
    rmse: f64,
    told: bool,
}

/// The diagram's coordinates.
struct Frame {
    x: Axis,
    y: Axis,
}

impl Frame {
    fn at(&self, time: f64, rmse: f64) -> At {
        (self.x.place(time), self.y.place(rmse))
    }
}

/// Draws all of it.
pub fn draw<B: DrawingBackend>(canvas: &Canvas<B>, summary: &Summary) -> Result<(), ChartError> {
    let shown = shown(summary);
    let frame = frame(&shown, summary).ok_or(ChartError::Empty)?;
    let mut page = Page::new(Taken::new((LEFT, TOP), (RIGHT, BOTTOM)));
    let limit = untold(&frame, summary);
    if let Some((top, _)) = limit {
        canvas.rectangle((LEFT, top), (RIGHT, BOTTOM), UNKNOWN)?;
    }
    draw_grid(canvas, &frame, summary.clock)?;
    if let Some((top, limit)) = limit {
        name_untold(canvas, top, limit, &mut page)?;
    }
    draw_title(canvas, summary)?;
    draw_fronts(canvas, &frame, summary, &shown, &mut page)?;
    for point in &shown {
        let at = frame.at(point.time.median, point.rmse);
        page.take(Taken::about(at, 5.5));
        let ends = [point.time.least, point.time.most].map(|time| frame.x.place(time));
        page.take(Taken::new((ends[0], at.1 - 4.0), (ends[1], at.1 + 4.0)));
    }
    for ladder in &summary.ladders {
        take_ladder(&frame, ladder, &shown, &mut page);
    }
    draw_guides(canvas, &frame, summary, &shown, &mut page)?;
    // The first ladder lies on top of those that share points with it.
    for ladder in summary.ladders.iter().rev() {
        draw_ladder(canvas, &frame, ladder, &shown)?;
    }
    for ladder in &summary.ladders {
        name_ladder(canvas, &frame, ladder, &shown, &mut page)?;
    }
    let mut named = Vec::new();
    for ladder in &summary.ladders {
        name_points(
            canvas,
            &frame,
            (ladder, summary),
            &shown,
            &mut named,
            &mut page,
        )?;
    }
    Ok(())
}

fn shown(summary: &Summary) -> Vec<Shown> {
    let place = |(index, point): (usize, &Point)| {
        let time = point.time(summary.clock)?;
        let told = point.shown(Metric::Rmse);
        let rmse = told.unwrap_or(point.limit.rmse);
        (time.least > 0.0 && rmse > 0.0).then_some(Shown {
            index,
            time,
            rmse,
            told: told.is_some(),
        })
    };
    summary
        .points
        .iter()
        .enumerate()
        .filter_map(place)
        .collect()
}

fn frame(shown: &[Shown], summary: &Summary) -> Option<Frame> {
    let times = shown
        .iter()
        .flat_map(|point| [point.time.least, point.time.most]);
    let limits = summary
        .truths
        .iter()
        .map(|truth| truth.reference.limit().rmse);
    let errors = shown.iter().map(|point| point.rmse);
    if shown.is_empty() {
        return None;
    }
    // Names of ladders lie at their right ends.
    let x = Axis::about(times, LEFT, RIGHT)?.with_room_above(0.05);
    let y = Axis::about(errors.chain(limits), BOTTOM, TOP)?.with_room_below(0.03);
    Some(Frame { x, y })
}

/// Below the largest limit some point's error can't be told: its place, and what it is. `None`: that is not shown.
fn untold(frame: &Frame, summary: &Summary) -> Option<(f64, f64)> {
    let limits = summary
        .truths
        .iter()
        .map(|truth| truth.reference.limit().rmse);
    let limit = limits.fold(0.0, f64::max);
    (limit > frame.y.least()).then(|| (frame.y.place(limit).max(TOP), limit))
}

fn name_untold<B: DrawingBackend>(
    canvas: &Canvas<B>,
    top: f64,
    limit: f64,
    page: &mut Page,
) -> Result<(), ChartError> {
    let text = format!(
        "below {}: within three times the reference's own error, not told",
        three_digits(limit)
    );
    let words = words(10.5, SOFT);
    let length = length(&text, words.size, words.bold);
    let middle = (0.5 * (top + BOTTOM) + 0.36 * words.size).min(BOTTOM - 4.0);
    page.take(Taken::new(
        (LEFT, middle - 10.0),
        (LEFT + 10.0 + length, BOTTOM),
    ));
    // Grid lines would cut the letters.
    canvas.rectangle(
        (LEFT + 6.0, middle - 9.5),
        (LEFT + 11.0 + length, middle + 3.5),
        UNKNOWN,
    )?;
    canvas.words(&text, (LEFT + 8.0, middle), words)
}

fn draw_grid<B: DrawingBackend>(
    canvas: &Canvas<B>,
    frame: &Frame,
    clock: Clock,
) -> Result<(), ChartError> {
    let color = |named: bool| if named { GRID } else { FAINT_GRID };
    for named in [false, true] {
        for tick in frame
            .x
            .ticks()
            .iter()
            .filter(|tick| tick.name.is_some() == named)
        {
            let x = frame.x.place(tick.value);
            canvas.line(&[(x, TOP), (x, BOTTOM)], color(named), 0.75)?;
        }
        for tick in frame
            .y
            .ticks()
            .iter()
            .filter(|tick| tick.name.is_some() == named)
        {
            let y = frame.y.place(tick.value);
            canvas.line(&[(LEFT, y), (RIGHT, y)], color(named), 0.75)?;
        }
    }
    canvas.line(&[(LEFT, TOP), (LEFT, BOTTOM), (RIGHT, BOTTOM)], INK, 1.25)?;
    for tick in frame.x.ticks() {
        let x = frame.x.place(tick.value);
        let reach = if tick.name.is_some() { 5.0 } else { 3.0 };
        canvas.line(&[(x, BOTTOM), (x, BOTTOM + reach)], INK, 1.0)?;
        if let Some(name) = tick.name {
            let words = Words {
                from: HPos::Center,
                ..words(12.0, INK)
            };
            canvas.words(&name, (x, BOTTOM + 18.0), words)?;
        }
    }
    for tick in frame.y.ticks() {
        let y = frame.y.place(tick.value);
        let reach = if tick.name.is_some() { 5.0 } else { 3.0 };
        canvas.line(&[(LEFT - reach, y), (LEFT, y)], INK, 1.0)?;
        if let Some(name) = tick.name {
            let words = Words {
                from: HPos::Right,
                ..words(12.0, INK)
            };
            canvas.words(&name, (LEFT - 8.0, y + 4.3), words)?;
        }
    }
    let time = match clock {
        Clock::Cpu => "CPU time of rendering, seconds of all threads",
        Clock::Wall => "time of rendering, seconds by the clock",
    };
    let across = Words {
        from: HPos::Center,
        ..words(13.0, INK)
    };
    canvas.words(time, (0.5 * (LEFT + RIGHT), BOTTOM + 40.0), across)?;
    let upwards = Words {
        turned: true,
        ..across
    };
    let error = "RMSE, linear radiance (white = 1)";
    canvas.words(error, (24.0, 0.5 * (TOP + BOTTOM)), upwards)
}

fn draw_title<B: DrawingBackend>(canvas: &Canvas<B>, summary: &Summary) -> Result<(), ChartError> {
    let title = Words {
        bold: true,
        ..words(17.0, INK)
    };
    let text = format!("{}: error against run time", summary.subject.scene);
    canvas.words(&text, (LEFT, 28.0), title)?;
    canvas.words(&subtitle(summary), (LEFT, 48.0), words(11.5, SOFT))
}

fn subtitle(summary: &Summary) -> String {
    let subject = &summary.subject;
    let models: Vec<String> = summary
        .truths
        .iter()
        .map(|truth| truth.reference.shading.to_string())
        .collect();
    let runs = summary
        .points
        .iter()
        .filter_map(|point| Some(point.wall_s?.runs));
    let runs = runs.min().unwrap_or_default();
    let together = if summary.sessions > 1 {
        ""
    } else {
        " interleaved"
    };
    format!(
        "{} \u{d7} {}, {}; {}; medians of {runs}{together} runs, bars from least to most",
        subject.size.0,
        subject.size.1,
        models.join(" and "),
        subject.device,
    )
}

/// Steps: up to a point's time nothing is better than the point before it.
fn draw_fronts<B: DrawingBackend>(
    canvas: &Canvas<B>,
    frame: &Frame,
    summary: &Summary,
    shown: &[Shown],
    page: &mut Page,
) -> Result<(), ChartError> {
    for truth in &summary.truths {
        let points: Vec<At> = truth
            .front
            .iter()
            .filter_map(|index| find(shown, *index))
            .map(|point| frame.at(point.time.median, point.rmse))
            .collect();
        let (Some(first), Some(last)) = (points.first(), points.last()) else {
            continue;
        };
        let mut steps = vec![(first.0, TOP), *first];
        for pair in points.windows(2) {
            steps.extend([(pair[1].0, pair[0].1), pair[1]]);
        }
        let end = (RIGHT, last.1);
        steps.push(end);
        canvas.line(&steps, FRONT, 1.3)?;
        for pair in steps.windows(2) {
            page.take_line(pair[0], pair[1]);
        }
        let text = "Pareto front";
        let style = words(11.0, FRONT);
        let length = length(text, style.size, style.bold);
        let below = (RIGHT - length - 4.0, last.1 + 13.0);
        let above = (RIGHT - length - 4.0, last.1 - 5.0);
        if let Some(at) = page.find(&[below, above], length, style.size) {
            canvas.words(text, at, style)?;
        }
    }
    Ok(())
}

/// A dashed line below a ladder, as steep as its observed order, that tells it.
fn draw_guides<B: DrawingBackend>(
    canvas: &Canvas<B>,
    frame: &Frame,
    summary: &Summary,
    shown: &[Shown],
    page: &mut Page,
) -> Result<(), ChartError> {
    let ladders = summary.ladders.iter();
    for ladder in ladders.filter(|ladder| ladder.knob == Knob::Spp) {
        // What may as well rise as fall has no order to show.
        if let Some(order) = ladder.order.as_ref().filter(|order| order.low > 0.0) {
            draw_guide(canvas, frame, (ladder, order), shown, page)?;
        }
    }
    Ok(())
}

fn draw_guide<B: DrawingBackend>(
    canvas: &Canvas<B>,
    frame: &Frame,
    (ladder, order): (&MeasuredLadder, &Order),
    shown: &[Shown],
    page: &mut Page,
) -> Result<(), ChartError> {
    let told: Vec<Shown> = members(ladder, shown).filter(|point| point.told).collect();
    let (Some(first), Some(last)) = (told.first(), told.last()) else {
        return Ok(());
    };
    // From the first point that was fitted: one sample has another filter.
    let first = told.get(1).unwrap_or(first);
    let (start, end) = (first.time.median, last.time.median);
    const BELOW: f64 = 0.72;
    let along = |time: f64| last.rmse * BELOW * (time / end).powf(-order.order);
    let (from, to) = (frame.at(start, along(start)), frame.at(end, along(end)));
    if from.1 > BOTTOM || to.1 > BOTTOM {
        return Ok(());
    }
    canvas.dashed(from, to, 5.0, SOFT, 1.2)?;
    page.take_line(from, to);
    let style = words(11.5, INK);
    let law = "RMSE ~ N";
    let exponent = format!("\u{2212}{:.2}", order.order);
    let interval = format!("95 %: {:.2} to {:.2}", order.low, order.high);
    const RAISED: f64 = 8.5;
    let law_length = length(law, style.size, false);
    let longest =
        (law_length + length(&exponent, RAISED, false)).max(length(&interval, style.size, false));
    // Under the line, where it has room, close to it or not; else above.
    let beside = [
        (-longest - 8.0, 22.0),
        (-longest - 8.0, 44.0),
        (10.0, -14.0),
    ];
    let shares = [0.35, 0.5, 0.2, 0.65, 0.1, 0.8, 0.95];
    let places: Vec<At> = beside
        .iter()
        .flat_map(|(right, down)| {
            shares.map(|share| {
                let x = from.0 + share * (to.0 - from.0);
                let y = from.1 + share * (to.1 - from.1);
                (x + right, y + down)
            })
        })
        .collect();
    if let Some(at) = page.find_best(&places, longest, 2.4 * style.size) {
        let raised = (at.0 + law_length + 1.0, at.1 - 13.5);
        canvas.words(law, (at.0, at.1 - 9.0), style)?;
        canvas.words(&exponent, raised, words(RAISED, INK))?;
        canvas.words(&interval, (at.0, at.1 + 5.0), words(11.5, SOFT))?;
    }
    Ok(())
}

fn take_ladder(frame: &Frame, ladder: &MeasuredLadder, shown: &[Shown], page: &mut Page) {
    let places: Vec<At> = members(ladder, shown)
        .map(|point| frame.at(point.time.median, point.rmse))
        .collect();
    for pair in places.windows(2) {
        page.take_line(pair[0], pair[1]);
    }
}

fn draw_ladder<B: DrawingBackend>(
    canvas: &Canvas<B>,
    frame: &Frame,
    ladder: &MeasuredLadder,
    shown: &[Shown],
) -> Result<(), ChartError> {
    let (color, mark) = look(ladder.knob);
    let points: Vec<Shown> = members(ladder, shown).collect();
    let places: Vec<At> = points
        .iter()
        .map(|point| frame.at(point.time.median, point.rmse))
        .collect();
    // Models have different truths: no line leads from one to the other.
    if ladder.knob != Knob::Shading && places.len() > 1 {
        canvas.line(&places, color, 1.8)?;
    }
    for (point, at) in points.iter().zip(&places) {
        draw_spread(canvas, frame, point, *at, color)?;
        canvas.mark(mark, *at, 4.2, color, !point.told)?;
    }
    Ok(())
}

fn draw_spread<B: DrawingBackend>(
    canvas: &Canvas<B>,
    frame: &Frame,
    point: &Shown,
    at: At,
    color: RGBColor,
) -> Result<(), ChartError> {
    const CAP: f64 = 3.5;
    let ends = [point.time.least, point.time.most].map(|time| frame.x.place(time));
    canvas.line(&[(ends[0], at.1), (ends[1], at.1)], color, 1.2)?;
    for x in ends {
        canvas.line(&[(x, at.1 - CAP), (x, at.1 + CAP)], color, 1.2)?;
    }
    Ok(())
}

/// Beside one of its ends, the later one first.
fn name_ladder<B: DrawingBackend>(
    canvas: &Canvas<B>,
    frame: &Frame,
    ladder: &MeasuredLadder,
    shown: &[Shown],
    page: &mut Page,
) -> Result<(), ChartError> {
    let title = match ladder.fixed.as_str() {
        "" => ladder.knob.title().to_owned(),
        fixed => format!("{} ({fixed})", ladder.knob.title()),
    };
    let style = Words {
        bold: true,
        ..words(11.5, darker(look(ladder.knob).0))
    };
    let length = length(&title, style.size, style.bold);
    let points: Vec<Shown> = members(ladder, shown).collect();
    let mut ends: Vec<At> = points
        .iter()
        .map(|point| frame.at(point.time.median, point.rmse))
        .collect();
    // Ends before what is between.
    if ends.len() > 2 {
        let first = ends.remove(0);
        ends.reverse();
        ends.insert(1, first);
    }
    let places: Vec<At> = [10.0, 16.0, 24.0, 34.0, 46.0]
        .iter()
        .flat_map(|distance| {
            ends.iter()
                .flat_map(|at| about(*at, *distance, length, style.size))
                .collect::<Vec<At>>()
        })
        .collect();
    match page.find_best(&places, length, style.size) {
        Some(at) => canvas.words(&title, at, style),
        None => Ok(()),
    }
}

/// Each point's own value, once for a point in several ladders, and where there is room.
fn name_points<B: DrawingBackend>(
    canvas: &Canvas<B>,
    frame: &Frame,
    (ladder, summary): (&MeasuredLadder, &Summary),
    shown: &[Shown],
    named: &mut Vec<usize>,
    page: &mut Page,
) -> Result<(), ChartError> {
    let style = words(10.5, darker(look(ladder.knob).0));
    for point in members(ladder, shown) {
        if named.contains(&point.index) {
            continue;
        }
        named.push(point.index);
        let text = ladder.knob.value_of(&summary.points[point.index].setting);
        let length = length(&text, style.size, style.bold);
        let at = frame.at(point.time.median, point.rmse);
        let places: Vec<At> = [7.0, 10.0, 14.0]
            .iter()
            .flat_map(|distance| about(at, *distance, length, style.size))
            .collect();
        if let Some(at) = page.find(&places, length, style.size) {
            canvas.words(&text, at, style)?;
        }
    }
    Ok(())
}

fn members<'s>(ladder: &'s MeasuredLadder, shown: &'s [Shown]) -> impl Iterator<Item = Shown> + 's {
    ladder.points.iter().filter_map(|index| find(shown, *index))
}

fn find(shown: &[Shown], index: usize) -> Option<Shown> {
    shown.iter().find(|point| point.index == index).copied()
}

/// Words that begin at their place.
fn words(size: f64, color: RGBColor) -> Words {
    Words {
        size,
        bold: false,
        color,
        from: HPos::Left,
        turned: false,
    }
}

/// Letters are thin: what is bright enough as a line is too bright for them.
fn darker(RGBColor(r, g, b): RGBColor) -> RGBColor {
    let dark = |c: u8| (0.72 * f64::from(c)) as u8;
    RGBColor(dark(r), dark(g), dark(b))
}

fn three_digits(value: f64) -> String {
    let decimals = (2 - value.log10().floor() as i32).clamp(0, 12) as usize;
    format!("{value:.decimals$}")
}
