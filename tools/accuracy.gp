# gnuplot: the pictures of docs/accuracy.md; `data` and `out` begin the names of what is read and written (accuracy.sh).
set datafile separator ","
set datafile missing NaN
set style line 1 lc rgb "#0072b2" lw 2 pt 6 ps 0.9
set style line 2 lc rgb "#d55e00" lw 2 pt 4 ps 0.9
set style line 3 lc rgb "#008060" lw 2 pt 8 ps 0.9
set style line 4 lc rgb "#7a4fa3" lw 2 pt 10 ps 0.9
set style line 8 lc rgb "#000000" lw 4
set style line 9 lc rgb "#d0d0d0" lw 0.6
set grid xtics ytics ls 9
set border 3 lc rgb "#606060"
set tics nomirror out textcolor rgb "#202020"

# ---- around each wedge: lines are this library's field, points the exact one
set terminal pngcairo size 860,540 font "sans,10" background "white"
set output out . "field.png"
set multiplot layout 2,2 margins 0.075,0.985,0.105,0.94 spacing 0.09,0.15
array degree[4] = [0, 60, 90, 120]
array source[4] = [45, 30, 30, 30]
array edge[4] = [360, 300, 270, 240]
set yrange [-45:9]
set ylabel "level, dB"
do for [w = 1:4] {
  file = sprintf("%sfield-%d.csv", data, degree[w])
  set title degree[w] == 0 ? "half-plane, source at 45 deg" : sprintf("%d deg wedge, source at %d deg", degree[w], source[w])
  set xrange [0:edge[w]]
  set xtics 45
  set xlabel w > 2 ? "angle from the lit face, deg" : ""
  set key inside bottom left Left reverse samplen 2 opaque
  if (w > 1) { unset key }
  plot file every ::1 using ($2 == 0 ? $1 : NaN):4 with lines ls 2 title "hard", \
    file every ::1 using ($2 == 0 ? $1 : NaN):3 with lines ls 1 title "soft", \
    file every ::1 using ($2 == 1 ? $1 : NaN):4 with points ls 2 title "hard, exact", \
    file every ::1 using ($2 == 1 ? $1 : NaN):3 with points ls 1 title "soft, exact"
}
unset multiplot

# ---- the largest error against kr
set terminal pngcairo size 1000,400 font "sans,10" background "white"
set output out . "kr.png"
set multiplot layout 1,2 margins 0.08,0.985,0.16,0.9 spacing 0.1
set xtics auto
set logscale x
set xrange [0.9:220]
set yrange [-100:-20]
set key inside bottom left Left reverse samplen 2
all = data . "all.csv"
array name[3] = ["60 deg", "90 deg", "120 deg"]
set ylabel "largest error, dB of the incident field"
set xlabel "kr"
set title "plane wave"
plot for [i = 1:3] all using (strcol(1) eq "conductor" && strcol(2) eq name[i] && strcol(3) eq "plane" && strcol(4) eq "soft" ? \
    column(5) : NaN):7 with linespoints ls i title name[i] . ", soft", \
  for [i = 1:3] all using (strcol(1) eq "conductor" && strcol(2) eq name[i] && strcol(3) eq "plane" && strcol(4) eq "hard" ? \
    column(5) : NaN):7 with linespoints ls i dt 2 title name[i] . ", hard"
set title "point source, 90 deg wedge, hard"
set xlabel "k, rad/m"
set ylabel ""
array depth[3] = ["0", "2.5", "10"]
plot for [i = 1:3] all using (strcol(1) eq "conductor" && strcol(2) eq "90 deg" && strcol(4) eq "hard" && \
    strcol(3) eq "point z=" . depth[i] . " m" ? column(5) : NaN):7 with linespoints ls i title depth[i] . " m along the edge", \
  all using (strcol(1) eq "conductor" && strcol(2) eq "half-plane" && strcol(4) eq "hard" && \
    strcol(3) eq "point z=0 m" ? column(5) : NaN):7 with linespoints ls 4 title "half-plane, 0 m"
unset multiplot
unset logscale x

# ---- a corner of concrete
set output out . "lossy.png"
set multiplot layout 1,2 margins 0.07,0.985,0.16,0.9 spacing 0.08
set xrange [0:270]
set xtics 45
set yrange [-45:25]
set xlabel "angle from the lit face, deg"
set ylabel "diffracted field, dB of the incident field / sqrt(kr)"
file = data . "lossy.csv"
# not on the boundaries themselves, 140 and 220 degrees, where the terms take their means
off(a) = abs(a - 140) < 0.3 || abs(a - 220) < 0.3 ? NaN : a
do for [p = 0:1] {
  set title p ? "H along the edge" : "E along the edge"
  set key inside top left Left reverse samplen 2
  if (p) { unset key; set ylabel "" }
  plot file index p using (off($1)):3 with lines ls 8 title "exact", file index p using (off($1)):5 with lines ls 2 title "luebbers", \
    file index p using (off($1)):6 with lines ls 3 title "holm", file index p using (off($1)):4 with lines ls 1 title "reciprocal"
}
unset multiplot

# ---- two screens
set output out . "edges.png"
set multiplot layout 1,2 margins 0.07,0.985,0.16,0.9 spacing 0.08
set xrange [0:6]
set xtics auto
set xlabel "local Fresnel number of each edge"
file = data . "edges.csv"
array spacing[2] = ["1000 / 1000 / 1000 m", "5000 / 200 / 5000 m"]
do for [p = 1:2] {
  set title spacing[p]
  set yrange [p == 1 ? -1 : -4 : p == 1 ? 4 : 17]
  set key inside top right Left reverse samplen 2
  set ylabel p == 1 ? "loss less the exact loss, dB" : ""
  if (p == 2) { unset key }
  plot 0 with lines ls 8 lw 1 notitle, file index p - 1 using 1:3 with lines ls 2 title "product", \
    file index p - 1 using 1:4 with lines ls 1 title "product with slopes"
}
unset multiplot

# ---- the end of an edge
set output out . "end.png"
set multiplot layout 1,2 margins 0.07,0.985,0.16,0.9 spacing 0.08
set xrange [-6:6]
set xtics auto
set xlabel "way from the end to the point, times the square root of k L''"
set yrange [0:1.3]
file = data . "end.csv"
set title "wave of the edge, over that of an endless one"
set key inside top left Left reverse samplen 2
set ylabel ""
plot file index 1 using 1:3 with lines ls 8 title "exact", file index 1 using 1:2 with lines ls 1 title "this program"
set title "error"
set yrange [0:0.8]
plot file index 1 using 1:5 with lines ls 2 title "cut off at the end", file index 1 using 1:4 with lines ls 1 title "faded out, this program"
unset multiplot
