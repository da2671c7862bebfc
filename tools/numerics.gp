# gnuplot: the pictures of docs/numerics.md; `data` and `out` begin the names of what is read and written (numerics.sh).
set datafile separator ","
set terminal pngcairo size 1000,400 font "sans,10" background "white"
set style line 1 lc rgb "#d55e00" lw 2 pt 4 ps 0.8
set style line 2 lc rgb "#0072b2" lw 2 pt 6 ps 0.8
set style line 3 lc rgb "#008060" lw 2.5 pt 7 ps 0.7
set style line 9 lc rgb "#d0d0d0" lw 0.6
set grid xtics ytics ls 9
set border 3 lc rgb "#606060"
set tics nomirror out textcolor rgb "#202020"
set format x "10^{%T}"
array name[3] = ["listings, single precision", "listings, double precision", "this kernel"]
# columns by method m: 4 + 3 m missed %, 5 + 3 m false %, 6 + 3 m error in 2^-23
eps = 2.0**-23
some(a) = a > 0 ? a : 1e-18

# ---- an edge comes up to the envelope
set output out . "tangency.png"
set multiplot layout 1,2 margins 0.08,0.985,0.16,0.86 spacing 0.1
set logscale x
set xrange [0.2:5e-18]
set xlabel "how far inside the envelope the edge passes / radius"
set title "hits that are missed, %"
set yrange [-2:60]
set key inside top left Left reverse samplen 2
plot for [m = 0:2] data . "tangency.csv" every ::1 using 1:(column(4 + 3 * m)) with linespoints ls m + 1 title name[m + 1]
set title "largest error of the reported range / distance"
set logscale y
set format y "10^{%T}"
set yrange [1e-18:1e-2]
unset key
plot for [m = 0:2] data . "tangency.csv" every ::1 using 1:(some(column(6 + 3 * m) * eps)) with linespoints ls m + 1
unset multiplot

# ---- a plane turns through the direction of a generator
set output out . "generator.png"
set multiplot layout 1,2 margins 0.08,0.985,0.16,0.86 spacing 0.1
set xrange [0.2:5e-18]
set xlabel "plane's angle to the axis less the half-angle, rad"
set title "ellipse: largest relative error of the far end (1: finite / infinite)"
set yrange [1e-16:10]
set key inside bottom right Left reverse samplen 2
plot for [m = 0:2] data . "generator.csv" every ::1 using ($1 > 0 ? $1 : NaN):(some(column(6 + 3 * m))) with linespoints ls m + 1 \
  title name[m + 1]
set xlabel "half-angle less the plane's angle to the axis, rad"
set title "hyperbola: the reported far end is finite, % of cases"
unset logscale y
set format y "%g"
set yrange [-4:110]
set xrange [5e-18:0.2]
unset key
plot for [m = 0:2] data . "generator.csv" every ::1 using ($1 < 0 ? -$1 : NaN):(column(5 + 3 * m)) with linespoints ls m + 1
unset multiplot

# ---- the half-angle vanishes
set output out . "half-angle.png"
set multiplot layout 1,2 margins 0.08,0.985,0.16,0.86 spacing 0.1
place(x) = x > 0 ? x : 1e-13
set xrange [5e-14:100]
set xtics ("0" 1e-13, "10^{-12}" 1e-12, "10^{-9}" 1e-9, "10^{-6}" 1e-6, "10^{-3}" 1e-3, "1" 1, "45" 45)
set xlabel "half-angle, degrees"
set title "cone through the edge that two triangles share: missed by both, %"
set yrange [-0.05:1]
set key inside top right Left reverse samplen 2
plot for [m = 0:2] data . "half-angle.csv" every ::1 using (place($1)):(column(4 + 3 * m)) with linespoints ls m + 1 title name[m + 1]
set title "largest error of the nearest z / distance"
set logscale y
set format y "10^{%T}"
set yrange [1e-17:1e-2]
unset key
plot for [m = 0:2] data . "half-angle.csv" every ::1 using (place($1)):(some(column(6 + 3 * m) * eps)) with linespoints ls m + 1
unset multiplot
set xtics auto
set format x "10^{%T}"

# ---- far from the world's origin
set output out . "offset.png"
set terminal pngcairo size 700,400 font "sans,10" background "white"
set lmargin 10
set xrange [0.8:1.3e7]
set xlabel "distance from the world's origin, m"
set ylabel "largest error of the range, m"
set title "cone and plane, 10 m apart: the same question, asked further and further away"
set yrange [1e-15:1e2]
set key inside top left Left reverse samplen 2
plot for [m = 0:2] data . "offset.csv" every ::1 using 1:(some(column(6 + 3 * m) * eps * 10)) with linespoints ls m + 1 title name[m + 1]

# ---- eight boxes
set output out . "boxes.png"
set terminal pngcairo size 1000,400 font "sans,10" background "white"
unset ylabel
set multiplot layout 1,2 margins 0.08,0.985,0.16,0.86 spacing 0.1
set xrange [0.008:60]
set xtics ("0.01" 0.01, "0.1" 0.1, "1" 1, "10" 10, "45" 45)
set xlabel "half-angle, degrees"
set title "round cones: boxes visited in vain, % of those met"
set yrange [0.05:2000]
set format y "%g"
set key inside top left Left reverse samplen 2
plot data . "boxes-round.csv" every ::1 using 1:5 with linespoints ls 1 title "listing 5", \
  "" every ::1 using 1:11 with linespoints ls 3 title name[3]
set title "eccentricity 0.995 (ten times as wide as high)"
unset key
plot data . "boxes-flat.csv" every ::1 using 1:5 with linespoints ls 1, "" every ::1 using 1:11 with linespoints ls 3
unset multiplot
