# gnuplot: the picture of docs/acoustics.md; `data` is the table of keller-bench-acoustics --csv, `out` the picture (acoustics.sh).
set datafile separator ","
set style line 1 lc rgb "#0072b2" lw 2 pt 6 ps 0.9
set style line 2 lc rgb "#d55e00" lw 2 pt 4 ps 0.9
set style line 3 lc rgb "#008060" lw 2 pt 8 ps 0.9
set style line 9 lc rgb "#d0d0d0" lw 0.6
set grid xtics ytics ls 9
set border 3 lc rgb "#606060"
set tics nomirror out textcolor rgb "#202020"
set terminal pngcairo size 1000,400 font "sans,10" background "white"
set output out
set multiplot layout 1,2 margins 0.065,0.985,0.14,0.91 spacing 0.085,0
set logscale x
set xrange [25:8000]
set xtics ("31.5" 31.5, "63" 63, "125" 125, "250" 250, "500" 500, "1k" 1000, "2k" 2000, "4k" 4000, "8k" 8000)
set xlabel "frequency, Hz"
set title "long edges: largest difference of UTD from BTM"
set ylabel "dB re free field"
set key top right Left reverse samplen 2
plot data every ::1 using 1:5 with linespoints ls 3 title "screen", \
  data every ::1 using 1:4 with linespoints ls 1 title "90 deg wedge", \
  data every ::1 using 1:3 with linespoints ls 2 title "60 deg wedge"
set title "behind a screen of 4 m by 1.5 m on a floor, all paths"
set key bottom left Left reverse samplen 2
plot data every ::1 using 1:7 with lines ls 1 title "BTM", data every ::1 using 1:6 with linespoints ls 2 title "UTD"
unset multiplot
